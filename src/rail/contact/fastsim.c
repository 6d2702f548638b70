/* SPDX-License-Identifier: BSD-3-Clause */
/* Kalker, A fast algorithm for the simplified theory of rolling contact, Vehicle System Dynamics 11, 1982: displacement
 * is flexibility times traction. In a strip along the direction of rolling traction grows, from the leading edge
 * backwards, by the slip of the bodies. It is cut to friction times pressure where it exceeds that. The pressure is a
 * paraboloid, which gives the correct slip.
 *
 * Strips lie at y = b sin(angle), angles in even steps: the summands are then smooth to the ends of the ellipse. In a
 * strip steps are even, and tractions are those in the middle of each. */
#include "rail/contact/fastsim.h"
#include <kempe/rolling_contact.h>
#include <math.h>

static const double pi = 3.14159265358979323846;

enum { STRIPS = 50 };

void kmp_fastsim_flexibilities(const kempe_creep *c, const kempe_kalker *k, double flexibility[3])
{
    double ratio = c->a / c->b;
    flexibility[0] = 8 * c->a / (3 * c->shear_modulus * k->c11);
    flexibility[1] = 8 * c->a / (3 * c->shear_modulus * k->c22);
    flexibility[2] = pi * c->a * sqrt(ratio) / (4 * c->shear_modulus * k->c23);
}

/* Kalker 1982: L = (|x| L1 + |y| L2 + c |spin| L3) / sqrt(x^2 + y^2 + c^2 spin^2), c = sqrt(a b). */
double kmp_fastsim_flexibility(const kempe_creep *c, const kempe_kalker *k)
{
    double each[3], weight[3] = {fabs(c->slip[0]), fabs(c->slip[1]), fabs(c->spin) * sqrt(c->a * c->b)};
    double size = hypot(hypot(weight[0], weight[1]), weight[2]), mean = 0;
    kmp_fastsim_flexibilities(c, k, each);
    for (int i = 0; i < 3; i++)
        mean += size > 0 ? weight[i] / size * each[i] : 0;
    return size > 0 ? mean : each[0];
}

/* A strip's contribution to the sums over x of traction and its moment, and the part of it that sticks. */
typedef struct strip_sum {
    double traction[2], turn, sticking;
} strip_sum;

/* The strip at y, `half` long to either side; `room` is the bound in its middle over half^2. */
static strip_sum strip(const kempe_creep *c, const double flexibility[3], int steps, double y, double half, double room)
{
    strip_sum sum = {.turn = 0};
    double dx = 2 * half / steps, before = half, p[2] = {0};
    for (int k = 0; k < steps; k++) {
        double x = half - (k + 0.5) * dx, length = before - x, middle = 0.5 * (before + x);
        p[0] -= length * (c->slip[0] / flexibility[0] - c->spin * y / flexibility[2]);
        p[1] -= length * (c->slip[1] / flexibility[1] + c->spin * middle / flexibility[2]);
        double size = hypot(p[0], p[1]), bound = room * (half * half - x * x);
        if (size > bound) {
            p[0] *= bound / size;
            p[1] *= bound / size;
        } else {
            sum.sticking += dx;
        }
        for (int i = 0; i < 2; i++)
            sum.traction[i] += dx * p[i];
        sum.turn += dx * (x * p[1] - y * p[0]);
        before = x;
    }
    return sum;
}

void kmp_fastsim(const kempe_creep *c, const double flexibility[3], kempe_creep_force *force)
{
    int strips = c->strips > 0 ? c->strips : STRIPS;
    double room = 2 * c->friction * c->normal / (pi * c->a * c->b) / (c->a * c->a), step = pi / strips;
    for (int k = 0; k < strips; k++) {
        double angle = (k + 0.5) * step - 0.5 * pi, width = c->b * cos(angle) * step;
        strip_sum sum = strip(c, flexibility, strips, c->b * sin(angle), c->a * cos(angle), room);
        for (int i = 0; i < 2; i++)
            force->force[i] += width * sum.traction[i];
        force->moment += width * sum.turn;
        force->sticking += width * sum.sticking / (pi * c->a * c->b);
    }
}
