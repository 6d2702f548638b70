/* SPDX-License-Identifier: BSD-3-Clause */
/* Search of the earliest change of a condition within a step, for a site that evaluates the motion. A step is initially
 * one piece. Bounds of each condition's value and rate over the piece decide if it can change there. It cannot if its
 * value stays away from zero; if its value is monotonic, the values at both ends decide. An undecided piece is halved,
 * the earlier half first. Generated simulators have this file too. */
#pragma once

#include "backend/bound_code.h"
#include <stdbool.h>

/** An evaluation at a time within the step. */
typedef struct kmp_event_probe {
    double t;
    double *change; /* value of each condition: it holds where this is negative */
    double *state;  /* what bounds need, as the site knows it */
    double *solved; /* solutions of implicit blocks in conditions */
} kmp_event_probe;

enum {
    KMP_SEARCH_DEPTH = 30,                  /* halvings of a step */
    KMP_SEARCH_LOOKS = KMP_SEARCH_DEPTH + 3 /* both ends of the step, and a middle for each halving */
};

/** A piece: its ends, and its middle if that has been evaluated. */
typedef struct kmp_step_piece {
    const kmp_event_probe *a, *m, *b;
} kmp_step_piece;

/** The motion and its conditions. A status is 0, or a number that ends the search. */
typedef struct kmp_piece_site {
    int (*look)(void *self, double t, kmp_event_probe *look);
    /** Computes bounds over a piece, at least of those conditions that are open. */
    void (*bind)(void *self, const kmp_step_piece *piece, const bool *open);
    /** The pieces of a condition, after `bind`. */
    kmp_bound (*bound)(const void *self, int condition);
    /** False for a condition that is not an event. */
    bool (*may_change)(const void *self, int condition);
    /** True for a condition that is fixed where its value is negative; false where it is at least zero. */
    bool (*holds)(const void *self, int condition);
    /** Ends a piece that its ends decide: finds the change within it, or takes the values at its end into account. */
    int (*end)(void *self, const kmp_event_probe *a, const kmp_event_probe *b, bool *found);
} kmp_piece_site;

/** Workspace of a search. */
typedef struct kmp_piece_search {
    const kmp_piece_site *site;
    void *self;
    int conditions;
    const bool *third; /* of each condition: its bounds need a third point */
    bool *open;        /* of each condition, for each halving and one more: it may change within the piece */
    kmp_event_probe look[KMP_SEARCH_LOOKS]; /* 0 and 1: of the ends of the step */
    int left;                               /* remaining evaluations in this step */
    long undecided; /* pieces that their ends have decided without bounds, as no evaluation remained */
    int which;      /* the condition of the first of them; its time */
    double since;
    int least; /* halvings made in any case */
} kmp_piece_search;

/** Searches the step between looks 0 and 1. */
KMP_LOCAL int kmp_pieces_search(kmp_piece_search *search, bool *found);

/** True if the values at the ends of a step, and in its middle if that is given, decide all conditions. */
KMP_LOCAL bool kmp_pieces_are_clear(kmp_piece_search *search, const kmp_step_piece *piece);

/** Bound of a quantity with values x and y and rates x_rate and y_rate at the ends of a piece of length h: a cubic. */
KMP_LOCAL kmp_bound kmp_bound_over(double h, double x, double x_rate, double y, double y_rate);
/** Bound of a quantity with values x, z in the middle, and y: a parabola. */
KMP_LOCAL kmp_bound kmp_bound_through(double h, double x, double z, double y);
KMP_LOCAL kmp_bound kmp_bound_still(double x);
