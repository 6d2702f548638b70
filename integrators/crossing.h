/* SPDX-License-Identifier: BSD-3-Clause */
/* The inside of a kmp_crossing, for the files that make one: events.c changes conditions, event_search.c finds where.
 */
#ifndef KMP_INTEGRATORS_CROSSING_H
#define KMP_INTEGRATORS_CROSSING_H

#include "backend/bounds.h"
#include "integrators/events.h"

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
    double *memory;
    int solved[2]; /* how many, of all conditions and of late ones; the first outputs of each */
    int first_solved[2];
    bool ready;  /* the look at the end of the last step is still good */
    long charts; /* version for which the bounds' constants are */
    int left;    /* looks that this step may still take */
    int least;   /* halvings that are made in any case */
} kmp_event_search;

struct kmp_crossing {
    const kempe_system *s;
    kmp_plant *plant;
    kmp_road *road;
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
    bool stuck;      /* one changed back and forth */
    bool *stays;     /* of each condition: it is not looked at until the next event */
    double instant;  /* of the run: nothing that moves does so in less */
    long count;
    int end; /* the condition that ends the run there; -1: none */
    kmp_journal *journal;
    kmp_event_search search;
};

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

bool kmp_event_search_init(kmp_event_search *search, const kempe_system *system);
void kmp_event_search_free(kmp_event_search *search);

#endif
