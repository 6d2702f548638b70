/* SPDX-License-Identifier: BSD-3-Clause */
/* Internals of friction that sticks in a run, for its files: elements and their inputs (friction_elements.c), the
 * decision on modes at a state (friction_problem.c), what follows from it (friction_run.c). */
#pragma once

#include "integrators/friction/friction_run.h"
#include "integrators/run/runner.h"
#include "linalg/dense/disc_minimum.h"

/* The state of motion of an element. */
typedef enum kmp_friction_stance {
    KMP_FRICTION_SLIPS,
    KMP_FRICTION_HELD,    /* by its row */
    KMP_FRICTION_CARRIED, /* at rest by the rows of others, with a given force */
    KMP_FRICTION_IDLE,    /* at rest by other closures: its force is not determined, and taken as zero */
    KMP_FRICTION_SMOOTH   /* regularised for a time */
} kmp_friction_stance;

typedef struct kmp_friction_element {
    int slot; /* its condition KMP_ROLE_SENSE */
    const char *name;
    const kmp_force *force;
    bool contact; /* a rigid contact: it slips where it is open, and its force is not negative */
    int base;     /* friction of a contact: the element of the contact; -1: none */
    int twin;     /* slip in two directions: the element of the other component; -1: none */
    double along; /* of these while it slips: the component of the direction */
    int rubs;     /* friction of a closed contact that slips, 1 or -1: its force takes part in the decision, not its
                   * mode; 0: none */
    double lift;  /* contact: an overlap that is none while it is open; 0: it is closed */
    bool struck;  /* contact: an impact at this instant has acted on it */
    bool pinned;  /* contact: closed by a study that decides on contacts itself */
    double still; /* an acceleration of its place that is none, in this decision */
    double back;  /* friction that slips: a rate against its sense that counts as none */
    kmp_friction_stance stance, was; /* now, and before the decision */
    double sense, before_sense;      /* of slip */
    bool fired, known;               /* its reserve was used up at the event; it has been decided before */
    bool implied;                    /* its row follows from closures */
    bool broken;                     /* it slips in this decision */
    bool loaded;                     /* its level depends on multipliers */
    bool tries;                      /* a message names it */
    bool smooth;                     /* regularised, since `smooth_t`, until it has left */
    double smooth_t;
    double before; /* its friction at the event */
    int changes;   /* of its mode since the count began */
} kmp_friction_element;

/* The decisions so far. */
typedef struct kmp_friction_past {
    double t; /* of the last one */
    int repeats;
    double since; /* of the count of changes */
    int changes;  /* decisions since then in which modes change */
    long total;   /* changes of modes of all elements in the run */
    bool known;   /* a decision has been made */
} kmp_friction_past;

struct kmp_friction_run {
    int count;
    kmp_friction_element *element;
    double *change;                        /* values of all conditions */
    int rest, *which;                      /* elements that decide, by number */
    int *partner;                          /* rest: the other component of slip in two directions; -1: none */
    double *d, *a;                         /* rest x rest, rest: accelerations a + D f of their places */
    double *lower, *upper, *f, *y, *tried; /* rest: bounds, forces, accelerations; forces of the last pass */
    double *found;                         /* rest: forces of a decision */
    double *aside;                         /* rest: forces put aside */
    double *room;
    int *side;
    kmp_friction_past past;
    bool spares; /* elements whose level depends on multipliers take no load */
    bool open;   /* levels do not settle: modes are tried */
    bool again;  /* an element is regularised from now on: the others are decided again */
    bool pins;   /* contacts are open or closed as a study has set them: only friction is decided */
};

/** The value of a role at the last measurement. */
double kmp_friction_at(const kmp_friction_run *x, const kmp_friction_element *e, kmp_role role);

/** Sets the input of a role. */
void kmp_friction_put(kmp_runner *run, const kmp_friction_element *e, kmp_role role, double input);

/** Size of an element's place: the scale of its row. */
double kmp_friction_scale(const kmp_runner *run, const kmp_friction_element *e);

/** 1/s: the rate of the motion. */
double kmp_friction_pace(const kmp_runner *run, const double *qd);

/** A rate of friction that counts as none, in sizes of its place and rates of the motion. */
double kmp_friction_still(const kmp_runner *run);

/** Friction of a contact that is open. */
void kmp_friction_set_off(kmp_runner *run, kmp_friction_element *e);

/** The rate of slip in two directions that counts as none: within it the direction is not known. */
double kmp_friction_halt(const kmp_runner *run, const kmp_friction_element *e, double rate);

/** The size of the force of element i of those at rest, both its components. */
double kmp_friction_size(const kmp_friction_run *x, int i);

/** The least x->f within the bounds `lower` and `upper` (box_minimum.h); its accelerations in x->y. */
kmp_box_outcome kmp_friction_minimum(kmp_friction_run *x, const double *lower, const double *upper);

/** Slip in a direction; a contact opens. `rate`: of the motion, 1/s. */
void kmp_friction_set_moving(kmp_runner *run, kmp_friction_element *e, double sense, double rate);

/** Slip (`none`: a rate against its sense that counts as none); rest with a given force (`none`: a larger rate is an
 * event); rest at a place by its row. */
void kmp_friction_set_slip(kmp_runner *run, kmp_friction_element *e, double sense, double none);
void kmp_friction_set_given(kmp_runner *run, kmp_friction_element *e, double force, double none);
void kmp_friction_set_held(kmp_runner *run, kmp_friction_element *e, double place);

/** Regularised by its `regularise`, until its rate is large. */
void kmp_friction_set_smooth(kmp_runner *run, kmp_friction_element *e);

/** True for an element that is regularised and has not left. */
bool kmp_friction_stays_smooth(const kmp_friction_run *x, const kmp_friction_element *e);

/** Chooses rows and coordinates with the present inputs, without a wish. */
kempe_status kmp_friction_choose(kmp_runner *run, double t, const double *q);

/** Accelerations and multipliers with the present inputs, and all values. */
kempe_status kmp_friction_measure(kmp_runner *run, double t, const double *q, const double *qd);

/** True if the row of an element, which is then held, is independent of the rows that are kept now. */
kempe_status kmp_friction_is_independent(kmp_runner *run, kmp_friction_element *e, double t, const double *q,
                                         bool *adds);

/** The same; rows and coordinates are then chosen with it. */
kempe_status kmp_friction_adds_row(kmp_runner *run, kmp_friction_element *e, double t, const double *q, bool *adds);

/** Decides which elements at rest slip (`broken`, `sense`); x->f has the forces of the others. `rate`: of the motion,
 * 1/s. */
kempe_status kmp_friction_decide(kmp_runner *run, double t, const double *q, const double *qd, double rate);

/** Sets up the problem of the elements at rest: x->which, a, d, and the levels in x->upper. */
kempe_status kmp_friction_pose(kmp_runner *run, double t, const double *q, const double *qd, double rate);

/** Rounding of the acceleration of element i of those at rest. */
double kmp_friction_rounding(const kmp_friction_run *x, int i);

/** Largest change of a force from the last pass, x->tried, over the largest force. */
double kmp_friction_changed(const kmp_friction_run *x);

/** The growth of levels with friction at a state, and the element whose level grows most. No row is held afterwards. */
kempe_status kmp_friction_grow(kmp_runner *run, double t, const double *q, const double *qd, double *growth, int *most);

/** Fails with the elements that can neither slip nor stick, and the growth of a level if that is the reason. */
kempe_status kmp_friction_complain(kmp_runner *run, double t, const double *q, const double *qd);

/** Divides the load of the elements that do not slip in x->f so that the largest part of a static level is least; if
 * possible without elements whose level depends on multipliers, and may fall at any time. */
void kmp_friction_share(kmp_friction_run *x);

/** At rest: *part of the static levels that friction needs to keep all elements at rest, INFINITY if it cannot; forces
 * in x->f, static levels in x->upper, by element. */
kempe_status kmp_friction_load(kmp_runner *run, double t, const double *q, const double *qd, double *part);
