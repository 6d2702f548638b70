/* SPDX-License-Identifier: BSD-3-Clause */
/* Simplified Newton along the mass-orthogonal direction: q by h, qd by J qd + h_t, with the factors of one place. */
#include "integrators/closing.h"

enum { CORRECTIONS = 2 };

static int saddle_place(void *self, double t, const double *q)
{
    kmp_saddle *saddle = self;
    kmp_plant_closure(saddle->plant, t, q);
    kmp_plant_mass(saddle->plant);
    return kmp_saddle_factor(saddle) ? KMP_RETRY : KMP_GO;
}

static void saddle_correction(void *self, const double *violation, double *dx)
{
    kmp_saddle_correction(self, violation, dx);
}

kmp_closing kmp_closing_by_saddle(kmp_saddle *saddle, double *violation, double *dx)
{
    return (kmp_closing){.self = saddle,
                         .plant = saddle->plant,
                         .n = saddle->n,
                         .violation = violation,
                         .dx = dx,
                         .place = saddle_place,
                         .correction = saddle_correction};
}

static void correct(const kmp_closing *c, const double *violation, double *x)
{
    c->correction(c->self, violation, c->dx);
    for (int i = 0; i < c->n; i++)
        x[i] += c->dx[i];
}

int kmp_closing_run(const kmp_closing *c, double t, double *q, double *qd)
{
    int said = c->place(c->self, t, q);
    for (int pass = 0; said == KMP_GO && pass < CORRECTIONS; pass++) {
        correct(c, c->plant->h, q);
        kmp_plant_rates(c->plant, qd, c->violation);
        correct(c, c->violation, qd);
        said = c->place(c->self, t, q);
    }
    return said;
}
