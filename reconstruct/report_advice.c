/* report_advice.c -- what a person can do about a warning. */
#include "report.h"

#include <string.h>

// By a phrase that the warning holds.
static const struct {
    const char *phrase, *advice;
} advice[] = {
    {"no tag of family",
     "Check that the board is in the picture, sharp and not cut off, and that capture.yaml names "
     "the tags' family. The shot is not used; take it again if it mattered for coverage."},
    {"are needed: left out",
     "Move so that more tags are in the picture and none is hidden by the sample or out of focus; "
     "the shot is not used."},
    {"usable shots: left out",
     "Each camera (and each zoom or focus setting) needs some shots of its own: take more with it, "
     "or leave its photographs out."},
    {"is not where capture.yaml says",
     "Measure this tag's place again, or print the board anew with goniocam board, which writes "
     "its part of capture.yaml too."},
    {"focal length is uncertain",
     "Add photographs that see the board at a slant of 30 to 60 degrees, from several sides."},
    {"the sample is not the",
     "Measure the sample. If it is misshapen by more than a few hundredths of a millimetre, use "
     "another one, or scan it and give shape: mesh."},
    {"its direction by board alone",
     "Switch off or cover other lights, look for bright walls near the board, and see that the "
     "board lies flat. If the direction by the sample agrees with the joint one, it is right."},
    {"its direction by sample alone",
     "Look for dirt, wear or a second material on the sample, and check its radius."},
    {"its direction by highlight alone",
     "Look for a second lamp or a window in the highlights, and check the sample's shape."},
    {"its direction by ball alone",
     "Check that the ball is round and clean, and measure its radius again."},
    {"is not seen near there",
     "Measure the ball's place again: it is looked for within a seventh of its radius."},
    {"two tags with id",
     "Cover one of them, or print another board: the same id must not be in the picture twice."},
    {"white patch is hardly seen",
     "The scale of the whole BRDF rests on the patch: take photographs under this lamp in which "
     "it is lit and not hidden."},
    {"no photosite shows lit sample",
     "Lamp and camera are on opposite sides of the sample: move one of them."},
    {"do not tell the black level", "Take each shot with two or more exposure times, or give "
                                    "noise: {black: ...} in capture.yaml."},
    {"do not tell the sensor's noise", "Take each shot with two or more exposure times, or give "
                                       "gain and read_noise in capture.yaml."},
    {"response curve",
     "Take brackets (exposure times 4 times apart), or better, raw files: those are linear."},
    {"this photograph is left out",
     "Copy the file from the camera again; without it the bracket has a gap."},
    {"no photograph of it can be read", "Copy the files from the camera again."},
    {"is an exposure missing",
     "Compare the files with the camera's card: goniocam merge CAPTURE --dry-run prints which "
     "photographs make which shot."},
    {"names decide",
     "If the camera's clock was right, rename the files in the order in which they were taken."},
    {"moved by about",
     "Use a tripod and a cable, or the timer, so that nothing moves within a bracket."},
    {"disagree with their neighbours", "Wipe sample and lens, and look at the pictures under "
                                       "Photographs for what stands in the way."},
    {"are not interchangeable",
     "See that the lamp stood still within its group of photographs, and compare the lamp's cues "
     "under Calibration."},
    {"it has a grain",
     "The material is anisotropic (brushed, woven): its table is the mean over all turns."},
    {"from place to place", "Clean the sample, turn it to an even side, and darken the room."},
    {"reference's albedo", "Compare the albedo in capture.yaml with the patch's data sheet."},
    {"is not among the photographs",
     "The calibration names a shot that this capture lacks; harmless if that was meant."},
};

const char *rec_report_advice(const char *warning)
{
    for (size_t i = 0; i < sizeof advice / sizeof *advice; i++)
        if (strstr(warning, advice[i].phrase))
            return advice[i].advice;
    return "Look at the shot or number that it names, below; if it is one shot, leave it out or "
           "take "
           "it again.";
}
