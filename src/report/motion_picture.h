/* SPDX-License-Identifier: BSD-3-Clause */
/* The moving mechanism: the drawn parts and their positions, frame by frame, as JSON. */
#ifndef KMP_REPORT_MOTION_PICTURE_H
#define KMP_REPORT_MOTION_PICTURE_H

#include "report/record.h"

/** Appends an object. The frames are rows. false: no memory. */
bool kmp_motion_picture(kmp_text *text, const kempe_model *model, const kmp_samples *row);

/** The number of frames that a picture of the model can have without omissions. */
int kmp_motion_picture_frames(const kempe_model *model);

/** The end time of the picture so that no joint rotates too far between frames; the record's own end when that
 * satisfies the limit. */
double kmp_motion_picture_end(const kempe_model *model, const kmp_record *record);

#endif
