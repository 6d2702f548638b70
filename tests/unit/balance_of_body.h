/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's and Euler's equations of a body b with the mass 1.5 and the inertia 1 about all axes, at rest: the load W
 * that it receives, by accelerations of its points. */
#pragma once

#include "evaluated.h"
#include "linalg/dense/dot.h"

/* Outputs: C is the centre of mass of b, whose X, Y, Z are one length from it, and Q the point about which the moment
 * is. */
#define BALANCE_OF_B                                                                                                   \
    "position(b.C), position(b.X), position(b.Y), position(b.Z), position(b.Q), acceleration(b.C), "                   \
    "acceleration(b.X), acceleration(b.Y), acceleration(b.Z), reaction(W), moment(W)]}\n"

typedef struct seen {
    double c[3], x[3][3], q[3], ac[3], ax[3][3], force[3], moment[3];
} seen;

/* At rest the points of b are accelerated by alpha x r: alpha = sum r x a / 2 over three r across each other. */
static inline void angular(const seen *s, double alpha[3])
{
    alpha[0] = alpha[1] = alpha[2] = 0;
    for (int k = 0; k < 3; k++) {
        double r[3], a[3], product[3];
        for (int i = 0; i < 3; i++) {
            r[i] = s->x[k][i] - s->c[i];
            a[i] = s->ax[k][i] - s->ac[i];
        }
        kmp_cross3(r, a, product);
        for (int i = 0; i < 3; i++)
            alpha[i] += product[i] / 2;
    }
}

/** At the start of a model in the gravity (1, 2, -10) with the outputs above; without `at_q` the force acts at C. */
static inline void check_balance(const char *text, bool at_q, double tolerance)
{
    static const double gravity[3] = {1, 2, -10};
    loaded l = load_text(text);
    kempe_run_options run = {0};
    evaluated e = evaluate(&l, &run, KEMPE_OK);
    if (e.rows > 0) {
        seen s;
        double alpha[3], arm[3], product[3];
        memcpy(&s, shown_at(&e, 0), sizeof s);
        angular(&s, alpha);
        for (int i = 0; i < 3; i++) {
            CHECK_NEAR(s.force[i], 1.5 * (s.ac[i] - gravity[i]), tolerance);
            arm[i] = at_q ? s.q[i] - s.c[i] : 0;
        }
        kmp_cross3(arm, s.force, product);
        for (int i = 0; i < 3; i++)
            CHECK_NEAR(alpha[i], s.moment[i] + product[i], tolerance);
    } else {
        printf("%s\n", text);
    }
    release(&e);
    unload(&l);
}
