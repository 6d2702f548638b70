/* SPDX-License-Identifier: BSD-3-Clause */
/* Events that end a formulation of a motion with sensitivities (forward.h). */
#pragma once

#include "base/arena.h"
#include "dynamics/system.h"
#include "integrators/formulations/formulation.h"

struct kmp_forward_formulation;

/** The event of the run that is passed between two formulations. */
typedef struct kmp_forward_event {
    bool passing;     /* the place is the one before it, with derivatives along it */
    int cause;        /* its condition; -1: none that depends on parameters */
    double *swing;    /* columns: dt_e/dp */
    double integrand; /* before it, and accelerations: n */
    double *qdd;
    bool *near;           /* conditions: the motion crosses them where an input jumps */
    double *last, last_t; /* columns: dt_e/dp of the event that was passed last, and its time */
    double *rows, *row;   /* m; n: room, a row of J */
} kmp_forward_event;

/** Makes room, once or again for other columns, which forgets the last event. False: no memory. */
bool kmp_forward_event_make(kmp_forward_event *event, kmp_arena *arena, const kempe_system *system, int columns);

/** dt_e/dp of the event that is passed; NULL: none is. */
static inline const double *kmp_forward_event_swing(const kmp_forward_event *event)
{
    return event->passing ? event->swing : NULL;
}

/** Keeps the place before an event of the run that changes rows or rates, with the derivatives of the last state at
 * t_e(p), along the event. */
int kmp_forward_leave_at_event(struct kmp_forward_formulation *f, double t, const double *y);

/** Takes next values of states and delayed signals, which may jump only at an event of the run. */
int kmp_forward_arrive_with_signals(struct kmp_forward_formulation *f, const kmp_formulation_start *start, bool first);

/** Derivatives of the rates behind an event of the run, or behind an impact at the start, in the place. */
int kmp_forward_arrive_after_event(struct kmp_forward_formulation *f, const kmp_formulation_start *start, bool first);

/** Ends an event: the derivatives at constant time, and what rows hold from now on. */
int kmp_forward_go_on_after_event(struct kmp_forward_formulation *f, const kmp_formulation_start *start, double *y);
