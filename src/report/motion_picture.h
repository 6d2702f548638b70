/* SPDX-License-Identifier: BSD-3-Clause */
/* The mechanism moving: what is drawn and where it is, frame by frame, as JSON. */
#ifndef KMP_REPORT_MOTION_PICTURE_H
#define KMP_REPORT_MOTION_PICTURE_H

#include "report/record.h"

/** Appends an object. The frames are rows. false: no memory. */
bool kmp_motion_picture(kmp_text *text, const kempe_model *model, const kmp_samples *row);

/** How many frames a picture of the model holds without leaving any out. */
int kmp_motion_picture_frames(const kempe_model *model);

/** How long the picture should go on so that no joint turns more from frame to frame than an eye can follow: the
 *  record's own end when that is so already. */
double kmp_motion_picture_end(const kempe_model *model, const kmp_record *record);

#endif
