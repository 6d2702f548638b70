/* SPDX-License-Identifier: BSD-3-Clause */
/* Decisions on the modes of friction that sticks, on plain arrays: elements and their inputs (friction_elements.c), the
 * decision at a state, growth of levels, division of loads, the modes that follow (friction_problem.c). The mechanism
 * belongs to a site, which evaluates it: a run of the library (friction_run.c), or a generated simulator. These files
 * need no other memory than the caller's. */
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
    double ahead;      /* of these while slip begins: the rate that is added to its own, which gives the direction */
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
    bool turned;                   /* the event was one of its slip */
    bool begins;                   /* its slip begins, and continues to begin in this decision */
    bool implied;                  /* its row follows from closures */
    bool broken;                   /* it slips in this decision */
    bool stays;                    /* held, and not connected with what this decision is about */
    bool loaded;                   /* its level depends on multipliers */
    bool sides;                    /* its levels depend on the direction */
    int unlimited;                 /* without a limit against positive (1) or negative (-1) rates; 0: with limits */
    bool tries;                    /* a message names it */
    bool shares;                   /* its force is not unique, of a contact or with one: shared_contacts.h */
    bool beside;                   /* an open contact that does not leave its surface: it may press */
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
    bool shared;  /* contacts have shared loads, which is reported; so is */
    bool felt;    /* that the motion has depended on how they share */
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
    double *under;                         /* rest: as `upper`, of the negative force */
    double *found;                         /* rest: forces of a decision */
    double *aside;                         /* rest: forces put aside */
    double *room;                          /* kmp_sharing_room(count) */
    int *side, *rows;
    double *kept; /* 2 n: the state before a decision, which is first only of what has changed; NULL: it is of all */
    kmp_friction_element *kept_element;
    int n; /* coordinates */
    bool partly;
    kmp_friction_past past;
    kmp_friction_cause cause; /* of a failure, or for which modes are tried one after the other */
    int tried_modes;          /* combinations of modes that have been tried; 0: none */
    double growth;            /* of the level of element `most`, which a failure names */
    int most;
    int locked;  /* an element that moves where it is without a limit; -1: none */
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
