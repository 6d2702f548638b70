// SPDX-License-Identifier: BSD-3-Clause
// Plane linkages in closed form for the programs examples/NAME/reference_NAME.c: points are complex numbers, circles
// meet.
#ifndef KEMPE_EXAMPLES_CIRCLES_H
#define KEMPE_EXAMPLES_CIRCLES_H

#include "quad.h"

typedef __complex128 point;

static inline point point_at(quad x, quad y)
{
    point p;
    __real__ p = x;
    __imag__ p = y;
    return p;
}

// The point at which a circle around a meets one around b, left of the way from a to b.
static inline point meet(point a, quad ra, point b, quad rb)
{
    point way = b - a;
    quad far = cabsq(way), along = (ra * ra - rb * rb + far * far) / (2 * far);
    return a + way / far * point_at(along, sqrtq(ra * ra - along * along));
}

#endif
