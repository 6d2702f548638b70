/* SPDX-License-Identifier: BSD-3-Clause */
#pragma once

#include "studies/simulate/trajectory.h"
#include <kempe/stepper.h>
#include <kempe/workspace.h>

struct kempe_stepper {
    const kempe_system *system;
    kmp_runner *runner;
    kmp_arena arena;
    kmp_run_spec spec;
    double t, stop;     /* the current time; the limit of steps, where an earlier break is not the same time */
    double own_stop;    /* the time of kempe_stepper_set_stop; INFINITY: none */
    bool keeps;         /* external inputs of the user's force are constant */
    bool samples;       /* the caller sets inputs of the model: no step goes beyond the requested time */
    bool given;         /* since the last step */
    bool bounded;       /* the caller gave no number of steps: each advance is bounded by its progress */
    bool steps;         /* a call makes steps: the force function may not make others */
    double *row, *next; /* q, qd, qdd, lambda; the one being made */
    double work;        /* of non-conservative forces, at the row */
    char *reason;
    kempe_status status;                       /* of the last call that moved it */
    bool doubted;                              /* by a call since its start */
    struct kmp_stepper_parameters *parameters; /* of kempe_stepper_set_parameters: owns `system`; NULL: none set */
    kempe_workspace *closer;                   /* of kempe_stepper_set_state; NULL: not made yet */
};

/** kempe_stepper_new with a resolved spec, whose pointers must outlive the stepper. */
kempe_status kmp_stepper_new(const kempe_system *system, const kmp_run_spec *spec, kempe_stepper **stepper);

/** Takes the row here again, with inputs that were set since. */
kempe_status kmp_stepper_stand_with_inputs(kempe_stepper *stepper);

/** A state of another run of the system at the end of one of its steps. It has no delayed signals. */
typedef struct kmp_stepper_start {
    double t, work, step, rate_scale;
    const double *q, *qd;             /* on closed loops */
    const double *modes;              /* NULL: by the state */
    const void *memory;               /* NULL: as at a start */
    const kmp_present_inputs *inputs; /* until t */
} kmp_stepper_start;

/** Continues from there. After a failure the stepper is unchanged. */
kempe_status kmp_stepper_continue(kempe_stepper *stepper, const kmp_stepper_start *start);

/** A state as bytes, for another process with the same system: their number; 0 where delayed signals have a past, whose
 * length changes. Bytes of a state of the same system come back as it; NULL: no memory. */
size_t kmp_stepper_packed_size(const kempe_system *system);
void kmp_stepper_pack(kempe_stepper_state *state, unsigned char *to);
kempe_stepper_state *kmp_stepper_unpack(const kempe_system *system, const unsigned char *from);
