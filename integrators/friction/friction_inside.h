/* SPDX-License-Identifier: BSD-3-Clause */
/* Decisions on the modes of friction that sticks, on plain arrays: elements and their inputs (friction_elements.c), the
 * decision at a state (friction_problem.c), growth of levels (friction_growth.c), division of loads (friction_load.c),
 * the modes that follow (friction_settle.c). The mechanism is that of a site, which evaluates it: a run of the library
 * (friction_run.c), or a generated simulator. These files need no other memory than that of the caller. */
#pragma once

#include "dynamics/kinematics/friction_roles.h"
#include "integrators/friction/friction_site.h"
#include "linalg/dense/disc_minimum.h"

/* The state of motion of an element. */
typedef enum kmp_friction_mode {
    KMP_FRICTION_SLIPS,
    KMP_FRICTION_HELD,    /* by its row */
    KMP_FRICTION_CARRIED, /* at rest by the rows of others, with a given force */
    KMP_FRICTION_IDLE,    /* at rest by other closures: its force is not determined, and taken as zero */
    KMP_FRICTION_SMOOTH   /* regularised for a time */
} kmp_friction_mode;

typedef struct kmp_friction_element {
    int slot;          /* its condition KMP_ROLE_SENSE */
    int row;           /* of J */
    double size;       /* of its place: the scale of its row */
    double regularise; /* speed by which it may be regularised; 0: it may not */
    bool contact;      /* a rigid contact: it slips where it is open, and its force is not negative */
    int base;          /* friction of a contact: the element of the contact; -1: none */
    int across;        /* 1 and 2: the components of slip in two directions; 0: it has one */
    int twin;          /* slip in two directions: the element of the other component; -1: none */
    double along;      /* of these while it slips: the component of the direction */
    int rubs;          /* friction of a closed contact that slips, 1 or -1: its force takes part in the decision, not
                        * its mode; 0: none */
    double lift;       /* contact: an overlap that is none while it is open; 0: it is closed */
    bool struck;       /* contact: an impact at this instant has acted on it */
    double stopped;    /* rounding of its rate, which an impact at this instant has made zero; 0: none has */
    double last;       /* contact: time of its last impact; -INFINITY: none yet */
    bool pinned;       /* contact: closed by a study that decides on contacts itself */
    double still;      /* an acceleration of its place that is none, in this decision */
    double back;       /* friction that slips: a rate against its sense that counts as none */
    kmp_friction_mode stance, was; /* now, and before the decision */
    double sense, before_sense;    /* of slip */
    bool fired, known;             /* its reserve was used up at the event; it has been decided before */
    bool implied;                  /* its row follows from closures */
    bool broken;                   /* it slips in this decision */
    bool loaded;                   /* its level depends on multipliers */
    bool tries;                    /* a message names it */
    bool smooth;                   /* regularised, since `smooth_t`, until it has left */
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
    const kmp_friction_site *site;
    int count;
    kmp_friction_element *element;
    double *change;                        /* values of all conditions */
    int rest, *which;                      /* elements that decide, by number */
    int *partner;                          /* rest: the other component of slip in two directions; -1: none */
    double *d, *a;                         /* rest x rest, rest: accelerations a + D f of their places */
    double *lower, *upper, *f, *y, *tried; /* rest: bounds, forces, accelerations; forces of the last pass */
    double *found;                         /* rest: forces of a decision */
    double *aside;                         /* rest: forces put aside */
    double *room;                          /* kmp_disc_room(count) */
    int *side;
    kmp_friction_past past;
    double growth; /* of the level of element `most`, which a failure names */
    int most;
    bool loads;  /* some level depends on multipliers */
    bool spares; /* elements whose level depends on multipliers take no load */
    bool open;   /* levels do not settle: modes are tried */
    bool again;  /* an element is regularised from now on: the others are decided again */
    bool pins;   /* contacts are open or closed as a study has set them: only friction is decided */
};

/* Returns a status that is not zero. */
#define KMP_FRICTION_TRY(call)                                                                                         \
    do {                                                                                                               \
        int kmp_friction_tried = (call);                                                                               \
        if (kmp_friction_tried != 0)                                                                                   \
            return kmp_friction_tried;                                                                                 \
    } while (0)

/** The value of a role at the last measurement. */
KMP_LOCAL double kmp_friction_at(const kmp_friction_run *x, const kmp_friction_element *e, kmp_role role);

/** The level of friction in slip (KMP_ROLE_LEVEL) or at rest (KMP_ROLE_STATIC); 0 for a contact, whose values of these
 * roles are its restitution and its coefficient of friction. */
KMP_LOCAL double kmp_friction_level_at(const kmp_friction_run *x, const kmp_friction_element *e, kmp_role role);

/** Sets the input of a role. */
KMP_LOCAL void kmp_friction_put(kmp_friction_run *x, const kmp_friction_element *e, kmp_role role, double input);

/** A rate of friction that counts as none, in sizes of its place and rates of the motion. */
KMP_LOCAL double kmp_friction_still(const kmp_friction_run *x);

/** Friction of a contact that is open. */
KMP_LOCAL void kmp_friction_set_off(kmp_friction_run *x, kmp_friction_element *e);

/** The rate of slip in two directions that counts as none: within it the direction is not known. */
KMP_LOCAL double kmp_friction_halt(const kmp_friction_run *x, const kmp_friction_element *e, double rate);

/** The size of the force of element i of those at rest, both its components. */
KMP_LOCAL double kmp_friction_size(const kmp_friction_run *x, int i);

/** The least x->f within the bounds `lower` and `upper` (box_minimum.h); its accelerations in x->y. */
KMP_LOCAL kmp_box_outcome kmp_friction_minimum(kmp_friction_run *x, const double *lower, const double *upper);

/** Slip in a direction; a contact opens. `rate`: of the motion, 1/s. */
KMP_LOCAL void kmp_friction_set_moving(kmp_friction_run *x, kmp_friction_element *e, double sense, double rate);

/** Slip (`none`: a rate against its sense that counts as none); rest with a given force (`none`: a larger rate is an
 * event); rest at a place by its row. */
KMP_LOCAL void kmp_friction_set_slip(kmp_friction_run *x, kmp_friction_element *e, double sense, double none);
KMP_LOCAL void kmp_friction_set_given(kmp_friction_run *x, kmp_friction_element *e, double force, double none);
KMP_LOCAL void kmp_friction_set_held(kmp_friction_run *x, kmp_friction_element *e, double place);

/** Regularised by its `regularise`, until its rate is large. */
KMP_LOCAL void kmp_friction_set_smooth(kmp_friction_run *x, kmp_friction_element *e);

/** True for an element that is regularised and has not left. */
KMP_LOCAL bool kmp_friction_stays_smooth(const kmp_friction_run *x, const kmp_friction_element *e);

/** Chooses rows and coordinates with the present inputs, without a wish. */
KMP_LOCAL int kmp_friction_choose(kmp_friction_run *x, double t, const double *q);

/** Accelerations and multipliers with the present inputs, and all values. */
KMP_LOCAL int kmp_friction_measure(kmp_friction_run *x, double t, const double *q, const double *qd);

/** True if the row of an element, which is then held, is independent of the rows that are kept now. */
KMP_LOCAL int kmp_friction_is_independent(kmp_friction_run *x, kmp_friction_element *e, double t, const double *q,
                                          bool *adds);

/** The same; rows and coordinates are then chosen with it. */
KMP_LOCAL int kmp_friction_adds_row(kmp_friction_run *x, kmp_friction_element *e, double t, const double *q,
                                    bool *adds);

/** Decides which elements at rest slip (`broken`, `sense`); x->f has the forces of the others. `rate`: of the motion,
 * 1/s. */
KMP_LOCAL int kmp_friction_decide(kmp_friction_run *x, double t, const double *q, const double *qd, double rate);

/** Sets up the problem of the elements at rest: x->which, a, d, and the levels in x->upper. */
KMP_LOCAL int kmp_friction_pose(kmp_friction_run *x, double t, const double *q, const double *qd, double rate);

/** Rounding of the acceleration of element i of those at rest. */
KMP_LOCAL double kmp_friction_rounding(const kmp_friction_run *x, int i);

/** Largest change of a force from the last pass, x->tried, over the largest force. */
KMP_LOCAL double kmp_friction_changed(const kmp_friction_run *x);

/** The growth of levels with friction at a state, and the element whose level grows most. No row is held afterwards. */
KMP_LOCAL int kmp_friction_grow(kmp_friction_run *x, double t, const double *q, const double *qd, double *growth,
                                int *most);

/** Fails with the elements that can neither slip nor stick, and the growth of a level if that is the reason. */
KMP_LOCAL int kmp_friction_complain(kmp_friction_run *x, double t, const double *q, const double *qd);

/** Divides the load of the elements that do not slip in x->f so that the largest part of a static level is least; if
 * possible without elements whose level depends on multipliers, and may fall at any time. */
KMP_LOCAL void kmp_friction_share(kmp_friction_run *x);

/** At rest: *part of the static levels that friction needs to keep all elements at rest, INFINITY if it cannot; forces
 * in x->f, static levels in x->upper, by element. */
KMP_LOCAL int kmp_friction_load(kmp_friction_run *x, double t, const double *q, const double *qd, double *part);

/** Begins the past of all elements, which are listed. */
KMP_LOCAL void kmp_friction_begin(kmp_friction_run *x);

/** Notes the elements whose events are passed at the conditions in x->change, and the present friction. */
KMP_LOCAL void kmp_friction_note_values(kmp_friction_run *x);

/** Notes a fact of an element (-1: none) in the log of the site. */
KMP_LOCAL void kmp_friction_tell(const kmp_friction_run *x, kmp_friction_fact fact, int element, double t,
                                 double number);

/** Lets go of all rows. */
KMP_LOCAL void kmp_friction_let_go(kmp_friction_run *x);

/** Decides on modes at t and the state (q, qd); rates are made consistent with the rows that are held, and the site is
 * evaluated there. */
KMP_LOCAL int kmp_friction_settle_modes(kmp_friction_run *x, double t, double *q, double *qd);
