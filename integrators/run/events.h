/* SPDX-License-Identifier: BSD-3-Clause */
/* Events: a condition of the model changes within a step. The step was made with all conditions fixed, so the solution
 * is smooth beyond the event. It is cut there, the conditions change, and the integrator restarts. */
#pragma once

#include "backend/bounds.h"
#include "constraints/evaluation/evaluator.h"
#include "integrators/decide/conditions.h"
#include "integrators/events/event_pieces.h"
#include "integrators/formulations/run_log.h"
#include "integrators/steppers/solver.h"

/** Contacts whose surfaces cannot meet while coordinates and times stay within a box, by bounds over it. Their
 * distances are not bounded in the pieces of a step within the box. */
typedef struct kmp_far_contacts {
    bool *far;          /* of each condition: it is the distance of such a contact */
    bool *asked;        /* of each condition: it may change within the box */
    double *low, *high; /* of each input that changes within a step: the box */
    double *mode;       /* of each condition: the mode with which the box was made */
    long charts;        /* version of the charts then */
    int steps;          /* since then */
    bool known;         /* there is a box */
    bool now;           /* the present step is within it */
    bool limits;        /* bounds are limited to the other conditions */
} kmp_far_contacts;

/** Workspace of the search for events. */
typedef struct kmp_event_search {
    kmp_bounds *bounds; /* of the conditions */
    int *output;        /* of each condition, among the outputs of their program */
    bool *third, *open;
    kmp_piece_search pieces; /* states in looks: q, qd, qdd (n each), lambda (m); the last two only if conditions depend
                              * on rates, or on qdd and lambda */
    const kmp_event_probe *ends[2]; /* of the present step */
    double event;                   /* time of the last one found */
    int solved[2];                  /* numbers, for all conditions and for late ones; the first output of each */
    int first_solved[2];
    bool ready;  /* the evaluation at the end of the last step is still valid: accelerations are unchanged */
    long charts; /* version of the charts in the bounds' constants */
    int *moves;  /* inputs of the bounds that change within a step; move_count of them */
    int move_count;
    bool stills; /* the others belong to this step */
    kmp_far_contacts away;
} kmp_event_search;

/** The last two values of a condition since its last change, for the largest value between them and the next. */
typedef struct kmp_last_values {
    int count;
    double t[2], x[2];
} kmp_last_values;

/** The past of a condition. */
typedef struct kmp_condition_past {
    double last;            /* time of its last change; -INFINITY: none yet */
    double most;            /* its largest evaluated value since then */
    double largest;         /* its largest value so far, at ends of steps */
    double peak;            /* of a measured condition: the largest value, by parabolas, since the last change */
    kmp_last_values latest; /* used of measured ones */
    bool reported, outside; /* of a condition of validity: it has been reported; it is violated in the present step */
    int repeats;            /* changes without time between them */
} kmp_condition_past;

/** The numbers that a state is completed to: q; q and qd; q, qd, qdd and lambda. */
typedef enum kmp_state_depth { KMP_STATE_PLACE, KMP_STATE_RATES, KMP_STATE_WHOLE } kmp_state_depth;

/** Completes the state at t within the last step: q, qd, qdd and lambda, at least to that depth. `again`: the state of
 * the last call, after conditions have changed, with which some integrators cannot interpolate. */
typedef kempe_status kmp_state_fn(void *user, double t, kmp_state_depth depth, bool again, double *q, double *qd,
                                  double *qdd, double *lambda);

/** The motion whose conditions are watched. */
typedef struct kmp_event_setup {
    const kempe_system *system;
    kmp_evaluator *eval; /* its conditions are the present ones, which the equations have */
    double span;         /* of the run, s */
    double rtol;
    bool kinks;   /* kinks of abs, min and max are passed like events */
    bool closely; /* conditions are evaluated at more places */
    kmp_run_log *log;
    kmp_state_fn *state;
    void *user;
} kmp_event_setup;

typedef struct kmp_event_tracker {
    kmp_event_setup plan;
    const kempe_system *s;
    kmp_evaluator *eval;
    int *kind;                       /* of each condition: kmp_condition_kind */
    double *size;                    /* of the place of a contact, for its sense; 0 for other conditions */
    const double *mode, *parameters; /* the present ones */
    const kmp_present_inputs *inputs;
    double *q, *qd, *qdd, *lambda; /* at the last evaluated point */
    double *change;                /* first - second there */
    int earliest;                  /* the condition that was located last */
    bool *located;                 /* of each condition of friction or of a contact: the last event is one of it */
    kmp_condition_past *past;      /* of each condition */
    double kink;                   /* part of the largest value of a kink beyond which it is fixed; 0: none is */
    bool stuck;                    /* a condition changed back and forth without end */
    bool *never;                   /* of each condition: a level that is not negative for any numbers */
    bool watches_validity;         /* conditions of validity are among the conditions */
    bool *stays;                   /* of each condition: it is not evaluated until the next event */
    bool *beyond;                  /* of each condition: the present event has passed it */
    double looked;                 /* time of the last look at the conditions */
    double instant;                /* least time of any motion of the run */
    double *before;                /* values of the conditions before states take next values */
    bool noted;                    /* they are known */
    long count;                    /* of events so far */
    int end;                       /* the condition that ends the run at the last event; -1: none */
    bool passed;                   /* the last step has passed a free kink */
    kmp_event_search search;
} kmp_event_tracker;

/** Makes a tracker, in the arena; NULL: no memory.
 *
 * For one-step methods kinks of abs, min and max are passed like events: between them the equations are smooth, as high
 * orders need. They are neither counted nor noted. Multistep methods, which restart at order one after each kink, gain
 * nothing. A kink that is passed within the errors of steps is ignored. */
kmp_event_tracker *kmp_event_tracker_new(const kmp_event_setup *plan, kmp_arena *arena);

/** Sets the pasts of the conditions of a run that begins. */
void kmp_event_tracker_begin_past(const kempe_system *system, kmp_condition_past *past);

/** The length with which a step between two times is made again up to the event that kmp_event_tracker_find has found;
 * 0: it is not. At the end of a compliant contact the law is continued beyond by the modulus of the depth, with a kink:
 * the polynomial of a step that meets it is wrong before it too. */
double kmp_event_tracker_shortens(const kmp_event_tracker *tracker, double from, double event, double to,
                                  kmp_repeated repeats);

/** Finds the event at a start. */
kempe_status kmp_event_tracker_begin(kmp_event_tracker *tracker, double t, bool *ends);

/** Changes the conditions at t of an event. The tracker has the state there on closed loops, with accelerations and
 * multipliers after the change if `rates`. KEMPE_E_FAILED with a message when conditions change back and forth without
 * end. */
kempe_status kmp_event_tracker_pass(kmp_event_tracker *tracker, double t, bool rates);

/** Changes the conditions at t of an event for a moment, until kmp_eval_set_modes with those `before`. The tracker has
 * the state there. */
kempe_status kmp_event_tracker_foresee(kmp_event_tracker *tracker, double t);

/** Notes the values of the conditions at t before states take next values. A condition that has changed at t, and whose
 * value the states do not change, then stays: positions that are closed again differ by rounding. */
void kmp_event_tracker_note(kmp_event_tracker *tracker, double t, const double *q, const double *qd);

/** Changes the conditions at t of an event with the closed state (q, qd). `again`: repeated with other rates. Earlier
 * changes are then kept, because positions that are closed again differ by rounding. *changed: a condition did. */
kempe_status kmp_event_tracker_change(kmp_event_tracker *tracker, double t, const double *q, const double *qd,
                                      bool again, bool *changed);

/** True if condition k with the value `change` differs from its fixed state. */
static inline bool kmp_event_tracker_differs(const kmp_event_tracker *c, int k, double change)
{
    return kmp_condition_differs((kmp_condition_kind)c->kind[k], c->mode[k], change);
}
static inline bool kmp_event_tracker_changed(const kmp_event_tracker *c, int k)
{
    return kmp_event_tracker_differs(c, k, c->change[k]);
}

/** Sets the values of those conditions of friction and contacts below zero whose event at t has been found: at a state
 * that is computed again they may be zero, or above it by rounding. */
void kmp_event_tracker_put_beyond(const kmp_event_tracker *tracker, double t, double *change);

/** Fixes free kinks that are away from zero in an evaluation at the end of a step. A kink that was away on the other
 * side in an evaluation before (NULL: there is none) stays free. */
void kmp_event_tracker_hold_free(kmp_event_tracker *c, const double *before, const double *change);

/** Doubts the start of the run for conditions of validity that are violated there, and logs the conditions of which a
 * run warns, where they hold; notes them for ensembles. */
void kmp_event_tracker_mark_start(kmp_event_tracker *c, double t);

/** The first changed condition that ends the run and that no other follows, -1: none. */
int kmp_event_tracker_first_end(const kmp_event_tracker *c);

/** Completes the state at a time within the last step, with accelerations and multipliers where conditions depend on
 * them, and evaluates the conditions. */
kempe_status kmp_event_tracker_look(kmp_event_tracker *c, double t);

/** True if a step had changes that bounds could not exclude within the bound of work, with a sentence that names the
 * first condition. The result is not trustworthy. */
bool kmp_event_tracker_is_undecided(const kmp_event_tracker *tracker, kmp_text *why);

/** Finds the earliest event of the step between two times. *t is its time, just beyond the change; unchanged if there
 * is none. */
kempe_status kmp_event_tracker_find(kmp_event_tracker *tracker, double from, double to, double *t, bool *found);

/** True if the values at the ends of a step, and in its middle if that is given, decide that no condition changes
 * within it; the tracker then takes them into account, as kmp_event_tracker_find does. Their `solved` may be NULL
 * where no condition has an implicit block, and no kink is to be fixed. */
bool kmp_event_tracker_is_clear(kmp_event_tracker *tracker, const kmp_event_probe *from, const kmp_event_probe *middle,
                                const kmp_event_probe *to);

/** Fixes the free kinks that the step of the last kmp_event_tracker_find has passed, on the side where it began, so
 * that the step can be made again up to the kink. False: there are none. */
bool kmp_event_tracker_hold_passed(kmp_event_tracker *tracker);

/** Watches the motion of another instance of the mechanism: its conditions, parameters, inputs and pasts. To
 * find and pass events, the evaluator must have the same. */
void kmp_event_tracker_take(kmp_event_tracker *tracker, const double *mode, const double *parameters,
                            const kmp_present_inputs *inputs, kmp_condition_past *past);
