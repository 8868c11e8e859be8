"""Figures against their limits, one a line; what is beyond them is counted."""
failed = 0


def check(what, value, low, high):
    global failed
    good = low <= value <= high
    failed += not good
    print("%-64s %10.5g  (%g to %g)%s" % (what, value, low, high, "" if good else "  FAILED"), flush=True)
