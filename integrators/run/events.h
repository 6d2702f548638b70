/* SPDX-License-Identifier: BSD-3-Clause */
/* Events: where a condition of the model changes within a step. The step was made with all conditions held, so the
 * solution is smooth beyond the event; it is cut there, the conditions change, and the integrator starts anew. events.c
 * changes conditions, event_search.c finds where. */
#ifndef KMP_INTEGRATORS_RUN_EVENTS_H
#define KMP_INTEGRATORS_RUN_EVENTS_H

#include "backend/bounds.h"
#include "base/arena.h"
#include "integrators/formulations/formulation.h"
#include "integrators/steppers/solver.h"

/** What was found at a time within the last step. */
typedef struct kmp_look {
    double t;
    double *change; /* first - second of each condition */
    double *state;  /* q, qd, qdd (n each), lambda (m); the last two where conditions depend on rates, or on more */
    double *solved; /* what implicit blocks solve for in conditions */
} kmp_look;

enum {
    KMP_SEARCH_DEPTH = 30,                  /* halvings of a step */
    KMP_SEARCH_LOOKS = KMP_SEARCH_DEPTH + 3 /* both ends of the step, and a middle for each halving */
};

/** What the search for events works with. */
typedef struct kmp_event_search {
    kmp_bounds *bounds; /* of the conditions */
    int *output;        /* of each condition, among those of their program */
    bool *third;        /* of each: its bounds want a third point */
    bool *open;         /* of each, for each halving: it may change within the piece, as far as is known */
    kmp_look look[KMP_SEARCH_LOOKS];
    int solved[2]; /* how many, of all conditions and of late ones; the first outputs of each */
    int first_solved[2];
    bool ready;  /* the look at the end of the last step is still good: accelerations are what they were */
    long charts; /* version for which the bounds' constants are */
    int left;    /* looks that this step may still take */
    int least;   /* halvings that are made in any case */
} kmp_event_search;

typedef struct kmp_crossing {
    const kempe_system *s;
    kmp_plant *plant;
    kmp_formulation *formulation;
    const kmp_solver_kind *kind;
    kmp_solver *solver;
    double *y, *yp, *q, *qd, *qdd, *lambda;
    double work;
    double *change; /* first - second at the last point that was looked at */
    double *last;   /* time of the last change of each condition */
    double *most;   /* the largest value of each since then, of what was looked at */
    int *repeats;
    double kink;     /* part of the largest value of a kink beside which it is held; 0: none is */
    double *largest; /* value of each condition so far, at ends of steps */
    bool stuck;      /* one changed back and forth without end */
    bool *stays;     /* of each condition: it is not looked at until the next event */
    double instant;  /* of the run: nothing that moves does so in less */
    long count;      /* of events so far */
    int end;         /* the condition that ends the run at what was found last; -1: none */
    kmp_journal *journal;
    kmp_event_search search;
    kmp_arena arena; /* of all arrays but those that a formulation's size decides */
} kmp_crossing;

/** NULL: no memory. All are used as they are at the time of a call. span: length of the run. `closely`: the run checks
 * another one, each step is looked at in more places.
 *
 * With rtol > 0 kinks of abs, min and max are passed like events, for one-step methods: between them the equations are
 * smooth, which is what high orders live on. They are neither counted nor noted. Multistep methods, which begin at
 * order one behind each, gain nothing. Where one is passed within what steps err by, it is run over. */
kmp_crossing *kmp_crossing_new(const kempe_system *system, kmp_plant *plant, double span, double rtol, bool closely,
                               kmp_journal *journal);
void kmp_crossing_free(kmp_crossing *crossing);

/** Goes on with a formulation, which outlives its use, and an integrator. false: no memory. */
bool kmp_crossing_move(kmp_crossing *crossing, kmp_formulation *formulation, const kmp_solver_kind *kind,
                       kmp_solver *solver);

/** Looks for the earliest event of the last step. *t is where, just beyond the change; left alone when there is none.
 */
kempe_status kmp_crossing_find(kmp_crossing *crossing, double *t, bool *found);

/** The same at a start, where the integrator is. */
kempe_status kmp_crossing_begin(kmp_crossing *crossing, double t, bool *ends);

/** Changes the conditions at such a t, closes the state and puts it into y (and yp): the new start. KEMPE_E_FAILED with
 * a message when conditions change back and forth without end. */
kempe_status kmp_crossing_pass(kmp_crossing *crossing, double t, double *y, double *yp);

/** Changes the conditions where the closed state at such a t is (q, qd). `again`: the same with other rates; what has
 * changed before stays so, for positions that are closed anew differ by rounding. *changed: one did. */
kempe_status kmp_crossing_change(kmp_crossing *crossing, double t, const double *q, const double *qd, bool again,
                                 bool *changed);

/* For the two files that make one. */

/** A kink of which no branch is held. */
static inline bool kmp_crossing_is_free(const kmp_crossing *c, int k)
{
    return c->s->events.condition[k].kink && c->plant->mode[k] == 0;
}

/** Whether condition k is no longer as it is held: with a value, at the last point that was looked at. */
static inline bool kmp_crossing_differs(const kmp_crossing *c, int k, double change)
{
    return !kmp_crossing_is_free(c, k) && (change < 0) != (c->plant->mode[k] > 0);
}
static inline bool kmp_crossing_changed(const kmp_crossing *c, int k)
{
    return kmp_crossing_differs(c, k, c->change[k]);
}

/** Holds the kinks that are free, and away from zero at a look at the end of a step. */
void kmp_crossing_hold_free(kmp_crossing *c, const double *change);

/** First one that others do not follow but that ends the run, likewise; -1 for none. */
int kmp_crossing_first_end(const kmp_crossing *c);

/** The state in c->y completed, or as much of it as conditions depend on, and the conditions there. */
kempe_status kmp_crossing_complete(kmp_crossing *c, double t, bool whole);

/** The same of the state at a time within the last step. */
kempe_status kmp_crossing_look(kmp_crossing *c, double t);

/** false: no memory; its bounds and the arena are to be freed. */
bool kmp_event_search_init(kmp_event_search *search, const kempe_system *system, bool closely, kmp_arena *arena);

#endif
