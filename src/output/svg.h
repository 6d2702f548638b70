/* SPDX-License-Identifier: BSD-3-Clause */
/* Common parts of all SVG pictures; lengths are pixels. */
#ifndef KMP_OUTPUT_SVG_H
#define KMP_OUTPUT_SVG_H

#include "base/text.h"

/** A white page. `style`: the CSS of the classes in use, and it scales when embedded in another page; NULL: neither. */
void kmp_svg_begin(kmp_text *text, double width, double height, const char *style);
void kmp_svg_end(kmp_text *text);

/** A tick spacing, 1, 2 or 5 times a power of ten: about `count` of them in a range. */
double kmp_svg_tick(double range, int count);

void kmp_svg_dot(kmp_text *text, double x, double y, double radius, const char *colour);

#endif
