"""Lossless JPEG (ITU-T T.81, process 14, SOF3) as raw files hold it: two components a line, predicted from the left."""
import struct

import numpy as np

# Bits of the code of a difference of so many bits: short for those that noise makes.
LENGTHS = {0: 5, 1: 5, 2: 4, 3: 3, 4: 3, 5: 3, 6: 3, 7: 3, 8: 4, 9: 5, 10: 6, 11: 7, 12: 7, 13: 7}


def codes():
    """Canonical Huffman codes by category, and the categories in the order of their codes."""
    order = sorted(LENGTHS, key=lambda c: (LENGTHS[c], c))
    code, last, table = 0, LENGTHS[order[0]], {}
    for c in order:
        code <<= LENGTHS[c] - last
        last = LENGTHS[c]
        table[c] = code
        code += 1
    return table, order


def differences(dn, bits):
    """dn [h][w] less what the sample two to the left (first: above; the very first: half) says."""
    d = dn.astype(np.int32)
    guess = np.empty_like(d)
    guess[:, 2:] = d[:, :-2]
    guess[1:, :2] = d[:-1, :2]
    guess[0, :2] = 1 << (bits - 1)
    return d - guess


def put(words, at, value, length):
    """OR the lowest length bits of value into the stream of 32-bit words, from the bits at[] (ascending) on."""
    word, wide = at >> 5, value << (64 - (at & 31) - length).astype(np.uint64)
    first = np.flatnonzero(np.diff(word, prepend=-1))
    words[word[first]] |= np.bitwise_or.reduceat(wide >> np.uint64(32), first).astype(np.uint32)
    words[word[first] + 1] |= np.bitwise_or.reduceat(wide & np.uint64(0xffffffff), first).astype(np.uint32)


def lossless_jpeg(dn, bits):
    """Bytes of a whole JPEG stream for dn [h][w], w even."""
    h, w = dn.shape
    table, order = codes()
    code_of = np.array([table[c] for c in range(14)], np.uint64)
    length_of = np.array([LENGTHS[c] for c in range(14)], np.int64)
    words, at, delta = np.zeros(dn.size * 20 // 32 + 4, np.uint32), 0, differences(dn, bits)
    for top in range(0, h, 256):
        d = delta[top:top + 256].ravel()
        category = np.frexp(np.abs(d))[1].astype(np.int64)  # bits of |d|
        extra = np.where(d < 0, d + (1 << category) - 1, d).astype(np.uint64)
        length = length_of[category] + category
        begin = at + np.cumsum(length) - length
        put(words, begin, code_of[category] << category.astype(np.uint64) | extra, length)
        at += int(length.sum())
    stream = np.frombuffer(words.astype(">u4").tobytes(), np.uint8)[:(at + 7) // 8]
    stream = np.insert(stream, np.flatnonzero(stream == 255) + 1, 0)
    counts = [sum(n == k for n in LENGTHS.values()) for k in range(1, 17)]
    return (b"\xff\xd8" + b"\xff\xc4" + struct.pack(">HB", 19 + len(order), 0) + bytes(counts) + bytes(order)
            + b"\xff\xc3" + struct.pack(">HBHHB6B", 14, bits, h, w // 2, 2, 1, 0x11, 0, 2, 0x11, 0)
            + b"\xff\xda" + struct.pack(">HB4B3B", 10, 2, 1, 0, 2, 0, 1, 0, 0) + stream.tobytes() + b"\xff\xd9")
