/* SPDX-License-Identifier: BSD-3-Clause */
/* Next values that states have taken since the last start (forward.h), at samples or at events: a run notes them, and
 * derivatives follow when the formulation resumes or begins. */
#pragma once

#include "base/arena.h"
#include "dynamics/system.h"

struct kmp_forward_formulation;

typedef struct kmp_forward_resets {
    int states;       /* with next values */
    int count, most;  /* times that some of them took these since the last start; with room */
    bool missed;      /* there was no room for a time */
    bool *taken;      /* of each time, by states */
    int *condition;   /* likewise: at whose change; -1: a sample */
    int cause;        /* the condition at whose time they change; -1: a time that depends on no parameter */
    double sampled_t; /* when states last changed at a sample; */
    int sampled;      /* one of them */
    double *next;     /* by states: room for derivatives of next values */
} kmp_forward_resets;

/** False: no memory. */
bool kmp_forward_resets_make(kmp_forward_resets *resets, kmp_arena *arena, const kempe_model *model);

/** States take next values (kmp_sample_fn). */
void kmp_forward_resets_note(kmp_forward_resets *resets, const bool *taken, const int *condition);

/** f->times.swing for the first time that is noted, which those after it follow from; `jump`: of delayed signals that
 * jump, NULL without any. */
int kmp_forward_find_reset_swing(struct kmp_forward_formulation *f, const double *jump, double t);

/** Maps the place, whose derivatives are those along the event, by the next values noted at each time. */
void kmp_forward_take_next_values(struct kmp_forward_formulation *f, double t);

/** Ends the motion where a state, of number `sample` in f->resets, and an event have one time, of which
 * only the time of the sample is the same for all parameters. The second function: if f->times.swing is of such an
 * event. */
int kmp_forward_halt_at_event(struct kmp_forward_formulation *f, int sample, double t);
int kmp_forward_halt_at_sample(struct kmp_forward_formulation *f, double t);
