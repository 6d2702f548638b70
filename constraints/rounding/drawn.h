/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers of a drawing that may be shifted to find the exact mechanism: the points, axes, frames and lengths around its
 * loops. Lengths are scaled by the characteristic length. */
#ifndef KMP_CONSTRAINTS_ROUNDING_DRAWN_H
#define KMP_CONSTRAINTS_ROUNDING_DRAWN_H

#include "model/variant.h"

/** A coordinate of a point or a length, a component of an axis, or a rotation of a frame about one of its axes. */
typedef struct kmp_drawn {
    kmp_number *scalar; /* NULL: the number belongs to an axis or a frame */
    double *axes;       /* the axis, or the frame row by row */
    bool frame;
    int k;           /* component of the axis; axis of rotation of the frame */
    double rounding; /* unit of its last digit in the drawing, scaled */
    kmp_number scalar_drawn;
    double axes_drawn[9];
    kmp_expr *sum; /* for a scalar with an expression: that expression plus the shift; in the model's arena */
} kmp_drawn;

/** Lists the numbers around the loops of a variant's model that are not zero, at most `most`. Returns their number; -1:
 * no memory. */
int kmp_drawn_list(kempe_model *model, int most, kmp_drawn *list);

/** Determines the rounding of each number. Returns the unit of the last digit of most numbers, scaled. */
double kmp_drawn_find_rounding(kmp_drawn *list, int count, double length);

/** Writes each number as drawn plus its shift into the model, whatever its parameters; shift NULL: as drawn. */
void kmp_drawn_place(kmp_drawn *list, int count, const double *shift, double length);

#endif
