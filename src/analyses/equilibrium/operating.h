/* SPDX-License-Identifier: BSD-3-Clause */
/* The state of a mechanism for its linear equations, its modes and its sensitivities. */
#pragma once

#include "analyses/equilibrium/equilibrium_study.h"
#include "base/arena.h"
#include "model/data/force.h"

typedef struct kmp_operating {
    const kempe_system *system;
    kmp_arena arena;            /* of all arrays */
    double t, *q, *qd;          /* n: in the user's coordinates */
    double *inner_q, *inner_qd; /* the state in these charts */
    double *trial;              /* of a search */
    int *kept, kept_count;      /* coordinates whose constant rates are the rates of the start (steady.h) */
    double *chart;              /* NULL: no joint is spherical */
    bool equilibrium;
    bool held;       /* a load holds a rate (steady.h) */
    bool warned;     /* of friction that sticks */
    bool slides;     /* set by the caller: friction that sticks has no force */
    double residual; /* of an equilibrium, relative */
} kmp_operating;

/** The state that a word names. "start" is the assembled start with its rates. "equilibrium" (also for NULL) is the
 * equilibrium that the assembled start leads to, all rates zero. "equilibrium shaft=60 rpm" is the steady motion with
 * these rates. `linear`, of this system, is used to search an equilibrium; NULL: one is made where needed.
 * KEMPE_E_ARGUMENT: no such word. KEMPE_E_FAILED, with the reason: it cannot be assembled, or there is no equilibrium.
 */
kempe_status kmp_operating_new(const kempe_system *system, const char *word, kmp_linear *linear,
                               kmp_operating **operating);
void kmp_operating_free(kmp_operating *operating);

/** Replaces the state by the equilibrium that it leads to, or without rates the steady motion
 * (kmp_equilibrium_or_steady), and takes `linear` there. For a search only by Newton's method the loops are closed
 * first with the current parameters. On failure (as of kmp_equilibrium_find and kmp_operating_check) the state is
 * unchanged. */
kempe_status kmp_operating_settle(kmp_operating *operating, kmp_linear *linear, kmp_search *search);

/** Takes `linear` to the state: its charts, independent coordinates (`wish`: those requested by the caller) and rates.
 * Friction that sticks at the state keeps its places, by rows that are held, unless it slides; a warning names it.
 * The accelerations follow from the equations of motion (zero at an equilibrium). Errors as kmp_linear_choose;
 * KEMPE_E_FAILED with a sentence also where the state is impossible, or a force is not finite. */
kempe_status kmp_operating_take(kmp_operating *operating, kmp_linear *linear, const int *wish, int wish_count);

/** Checks that forces are unchanged while coordinates move steadily, unless an exchange fixes these, at a state that
 * was found. KEMPE_E_FAILED: they change. */
kempe_status kmp_operating_check(kmp_linear *linear, const kmp_search *search);
