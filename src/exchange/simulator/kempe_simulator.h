/* SPDX-License-Identifier: BSD-3-Clause */
/**
 * A simulator of one mechanism, made of generated equations: C99, no library but libm, no allocation, no static data
 * that changes. Several simulators may run in several threads, each in separate memory.
 *
 *     #include "crane_simulator.h"
 *
 *     static double memory[crane_memory];
 *     kempe_simulator crane;
 *     kempe_simulator_init(&crane, &crane_equations, memory);
 *     if (kempe_simulator_start(&crane, 0) == KEMPE_SIMULATOR_GOES)
 *         while (kempe_simulator_advance(&crane, crane.t + 0.01) == KEMPE_SIMULATOR_GOES)
 *             show(crane.t, crane.q);
 *
 * The equations:  M qdd + C = J' lambda,  h = 0,  J qd + h_t = 0,  J qdd + jdqd = 0. States are f independent
 * coordinates and their rates (coordinate partitioning: Wehage and Haug 1982). Newton's method closes the loops for the
 * others. The choice is exchanged where it becomes bad. SI units: m, rad, kg, s, N, N m.
 */
#ifndef KEMPE_SIMULATOR_H
#define KEMPE_SIMULATOR_H

#ifdef __cplusplus
extern "C" {
#endif

/** Meaning of a condition. It holds where its value is negative. */
enum {
    KEMPE_CONDITION_SWITCHES, /* its change is an event; the equations read it in `modes` */
    KEMPE_CONDITION_ENDS,     /* the motion ends where it holds */
    KEMPE_CONDITION_KINK,     /* of min, max, abs: where its mode is 0 the equations follow it by themselves */
    KEMPE_CONDITION_PASSES,  /* of friction and contacts: that it holds is an event, at which modes are decided again */
    KEMPE_CONDITION_NUMBER,  /* of these: a number for the decisions; its mode is an input of them */
    KEMPE_CONDITION_VALIDITY /* a table is used beyond its points, a level of friction is negative, ..: the message
                              * reports this, the motion continues */
};

/** True for a kind whose change of sign is an event for an integrator of the caller. */
#define KEMPE_CONDITION_IS_EVENT(kind) ((kind) != KEMPE_CONDITION_KINK && (kind) < KEMPE_CONDITION_NUMBER)

/** Parts of its given start that a coordinate keeps when loops are closed. */
enum {
    KEMPE_START_KEEPS_PLACE = 1,
    KEMPE_START_KEEPS_RATE = 2,
    KEMPE_START_BALANCES = 4, /* a deformation: it moves into balance with the loads of the start, */
    KEMPE_START_STAYS = 8     /* while these coordinates stay */
};

/** Kind of a coordinate: of `q`, and its rate. A state of the model is in `qd`; its integral is in `q`. */
enum { KEMPE_COORDINATE_TRANSLATION, KEMPE_COORDINATE_ROTATION, KEMPE_COORDINATE_STATE };

/** Arguments of the equations. Arrays of a simulator; matrices are stored row by row, M whole. */
typedef struct kempe_arguments {
    double t;
    const double *k;      /* prepared values of the parameters */
    const double *q;      /* coordinates */
    const double *qd;     /* their rates */
    const double *qdd;    /* accelerations */
    const double *lambda; /* rows: multipliers of h */
    const double *modes;  /* conditions: 1 if it holds, otherwise 0; of kinks 1, -1, or 0: not fixed */
    const double *u;      /* three an input: value, first and second derivative */
    const double *chart;  /* nine a spherical joint: the orientation from which its angles count, row by row */
} kempe_arguments;

/** A direction in the space of the arguments; `p` has an entry for each parameter. */
typedef struct kempe_direction {
    double t;
    const double *p, *q, *qd, *qdd, *lambda, *u;
} kempe_direction;

/** The right-hand side for a choice of coordinates and rows, with its linear algebra written out. */
typedef struct kempe_slopes {
    const int *independent, *dependent, *rows; /* f, n - f, n - f */
    /** Accelerations udd[f] of the independent and rates vd[n - f] of the dependent coordinates, at t, q, modes, u and
     * qd of the independent ones. checks[2]: the least pivot of the reduced mass, and an excess of the elimination. The
     * results are good where the first is positive and the second at most 1. */
    void (*evaluate)(const kempe_arguments *at, double *udd, double *vd, double *checks);
} kempe_slopes;

/** The arguments that bounds read, each with its place. */
enum {
    KEMPE_WATCH_TIME,
    KEMPE_WATCH_Q,
    KEMPE_WATCH_QD,
    KEMPE_WATCH_QDD,
    KEMPE_WATCH_LAMBDA,
    KEMPE_WATCH_STILL, /* from here on constant during a step: modes */
    KEMPE_WATCH_CHART,
    KEMPE_WATCH_PARAMETER,
    KEMPE_WATCH_INPUT
};

/** Bounds of a condition need the middle of a piece too; it ends a compliant contact, whose law has a kink there. */
enum { KEMPE_WATCH_MIDDLE = 1, KEMPE_WATCH_PRESSES = 2, KEMPE_WATCH_ROUGH = 4 };

/** A function given by points. */
typedef struct kempe_watch_table {
    int knots, degree;
    const double *x, *y, *pieces; /* four coefficients a piece */
} kempe_watch_table;

struct kmp_watch_site;

/** Bounds of the conditions and of their rates during a part of a step, by which their changes are found: operations in
 * order, on constants, inputs, and the results of operations before. The function is in kempe_events.c, which
 * models without conditions do not need. */
typedef struct kempe_watch {
    int constants, inputs, steps, tables;
    int fixed;  /* the first steps depend only on parameters */
    int solved; /* unknowns of implicit blocks in conditions, which are given */
    const double *constant;
    const int *input;       /* what each is, and its place */
    const unsigned *step;   /* operation and three operands each: a value << 1 | its sign */
    const unsigned *output; /* operands: of the conditions, then of the unknowns */
    const int *traits;      /* conditions: KEMPE_WATCH_MIDDLE | .. */
    const kempe_watch_table *table;
    /** Values of the conditions, then of the unknowns; NULL without unknowns. */
    void (*values)(const kempe_arguments *at, double *value);
    /** Finds the earliest change between two times; 0, a status of the site, or 2 + a condition that is not decided. */
    int (*search)(const struct kempe_watch *watch, double *room, const struct kmp_watch_site *site, double from,
                  double to, int *found);
} kempe_watch;

int kempe_watch_search(const kempe_watch *watch, double *room, const struct kmp_watch_site *site, double from,
                       double to, int *found);

struct kmp_friction_site;
struct kmp_impact_site;

/** Friction that sticks and rigid contacts, by elements: forces in one direction each, with a row of h that holds their
 * place at rest, or keeps surfaces together. The functions are in kempe_friction.c, which other models do not
 * need. */
typedef struct kempe_friction {
    int elements;
    const int *slot;          /* the first of its conditions: eight, or ten with `sides` */
    const int *row;           /* of h */
    const int *base;          /* friction of a contact: the element of the contact; -1: none */
    const int *across, *twin; /* 1 and 2: components of slip in two directions, and the other one; 0 and -1: none */
    const int *loaded;        /* 1 where its level depends on multipliers */
    const int *sides;         /* 1 where its levels depend on the direction */
    const int *unlimited;     /* without a limit against positive (1) or negative (-1) rates; 0: with limits */
    const double *size;       /* of its place */
    const double *regularise; /* a speed by which it may be regularised; 0: it may not */
    int loads;                /* 1 where levels depend on multipliers, or forces on contacts */
    const int *contact;       /* 1 of a rigid contact */
    int contacts;             /* their number */
    int driven;               /* 1 where closures depend on time */
    int rolls;                /* rows between rates, whose h is zero */
    /** In the memory of a simulator: `kept` of its state, `room` between calls. Starts the decisions. */
    void (*begin)(const struct kempe_friction *friction, double *kept);
    /** Notes the values of all conditions at an event. */
    void (*note)(const struct kempe_friction *friction, double *kept, const double *value);
    /** Lets go of all rows. */
    void (*let_go)(const struct kempe_friction *friction, double *kept, const struct kmp_friction_site *site);
    /** Decides at t, q, qd; 0, or a status of the site. */
    int (*settle)(const struct kempe_friction *friction, double *kept, double *room,
                  const struct kmp_friction_site *site, double t, double *q, double *qd);
    /** Changes rates where contacts strike; *since: the time since the impact before of a contact that strikes twice,
     * or INFINITY. 0, or a status of the sites. NULL without contacts. */
    int (*strike)(const struct kempe_friction *friction, double *kept, double *room,
                  const struct kmp_friction_site *site, const struct kmp_impact_site *impacts, int n, double t,
                  double *q, double *qd, double *since);
    /** The first contact whose surfaces overlap; -1: none. NULL without contacts. */
    int (*overlap)(const struct kempe_friction *friction, double *kept, double *room,
                   const struct kmp_friction_site *site, int n, double t, const double *q, const double *qd);
} kempe_friction;

void kempe_friction_begin(const kempe_friction *friction, double *kept);
void kempe_friction_note(const kempe_friction *friction, double *kept, const double *value);
void kempe_friction_let_go(const kempe_friction *friction, double *kept, const struct kmp_friction_site *site);
int kempe_friction_settle(const kempe_friction *friction, double *kept, double *room,
                          const struct kmp_friction_site *site, double t, double *q, double *qd);
int kempe_friction_strike(const kempe_friction *friction, double *kept, double *room,
                          const struct kmp_friction_site *site, const struct kmp_impact_site *impacts, int n, double t,
                          double *q, double *qd, double *since);
int kempe_friction_overlap(const kempe_friction *friction, double *kept, double *room,
                           const struct kmp_friction_site *site, int n, double t, const double *q, const double *qd);

/** Spherical joints whose angles count from an orientation that changes between steps, before they become singular:
 * the coordinates of the motion. Coordinates of the caller count from the model's. The functions are in kempe_charts.c,
 * which models without such joints do not need. */
typedef struct kempe_charts {
    int joints;
    const int *first;   /* coordinate of each, of three */
    const int *before;  /* 1: the orientation comes before the three rotations */
    const double *axes; /* three unit vectors each */
    /** 1 in the middle of the second angle's range, 0 where the axes are singular. */
    double (*regular)(const struct kempe_charts *charts, int c, const double *q);
    /** Begins a new chart at q, qd, which are changed. */
    void (*center)(const struct kempe_charts *charts, int c, double *chart, double *q, double *qd);
    /** The caller's angles, nearest to near[3]; their distance, or the distance of q from `before`, its values there,
     * if that is larger. `sided`: on the same side of the singular position. */
    double (*follow)(const struct kempe_charts *charts, int c, const double *chart, const double *before,
                     const double *near, int sided, const double *q, double *angles);
    /** Converts q, qd, qdd to the caller's coordinates, with angles nearest to near[3]. */
    void (*show)(const struct kempe_charts *charts, int c, const double *chart, const double *near, double *q,
                 double *qd, double *qdd);
    /** Converts small changes of q, qd, qdd to the caller's coordinates. */
    void (*carry)(const struct kempe_charts *charts, int c, const double *chart, const double *const inner[3],
                  const double *const shown[3], double *const change[3]);
} kempe_charts;

double kempe_chart_regular(const kempe_charts *charts, int c, const double *q);
void kempe_chart_center(const kempe_charts *charts, int c, double *chart, double *q, double *qd);
double kempe_chart_follow(const kempe_charts *charts, int c, const double *chart, const double *before,
                          const double *near, int sided, const double *q, double *angles);
void kempe_chart_show(const kempe_charts *charts, int c, const double *chart, const double *near, double *q, double *qd,
                      double *qdd);
void kempe_chart_carry(const kempe_charts *charts, int c, const double *chart, const double *const inner[3],
                       const double *const shown[3], double *const change[3]);

/** The start of a mechanism, and how it moves with parameters. */
typedef struct kempe_start {
    const double *q, *qd;   /* n: a closed start */
    const int *independent; /* f coordinates, the choice at the start; NULL: the simulator chooses */
    /** Start values of q and qd as the model gives them, n x 2, at the parameters. NULL: they depend on none. */
    void (*values)(const kempe_arguments *at, double *values);
    const double *given; /* n x 2: at the parameters of the model; NULL with `keeps`: none move */
    const int *keeps;    /* n: KEMPE_START_KEEPS_PLACE | .. */
} kempe_start;

/** States that keep their value between samples or events. */
typedef struct kempe_discrete {
    int states;
    const int *place;     /* in qd */
    const double *period; /* s, between samples, the first at t = 0; INFINITY: without samples */
    const int *condition; /* whose change is the event; -1: none */
    const int *sense;     /* 1: the event is that the condition begins to hold, 0: that it ends */
    const int *settles;   /* 1: a state changes at the start too, where its condition holds there */
    /** Their next values at t, q, qd, u. NULL: there are none. */
    void (*next)(const kempe_arguments *at, double *value);
} kempe_discrete;

/** The equations of a mechanism, generated; all names and pointers are constant. */
typedef struct kempe_equations {
    const char *name, *hash; /* of the model */
    int coordinates, rows;   /* n, m */
    int freedom;             /* f: n less the rank of J; 2 f states */
    int inputs, parameters, conditions, outputs;
    int kept; /* values of k */
    const char *const *coordinate_names, *const *row_names, *const *input_names, *const *parameter_names;
    const char *const *condition_names, *const *output_names;
    const char *const *advice;      /* conditions: if it ends the motion, the remedy; if it is one of validity, the
                                       consequence; may be NULL */
    const int *coordinate_kind;     /* n */
    const int *condition_kind;      /* conditions */
    const double *scale;            /* n: size of a coordinate */
    const double *row_scale;        /* m: size of a row of h */
    const double *parameter_values; /* of the model */
    const int *parameter_fixed;     /* parameters: 1 where h depends on it, or only the start: a start must follow */
    const double *input_values;     /* 3 inputs: at the start */
    const char *const *input_moves; /* inputs: the closure that each moves, "" without one; NULL: none does */
    double rank_tolerance;          /* a pivot of the scaled J below this part of the largest one is zero */
    kempe_start start;

    void (*prepare)(const double *p, double *k);
    /** h[m], J[m n], h_t[m] at t, q, modes, u. */
    void (*closures)(const kempe_arguments *at, double *h, double *J, double *h_t);
    /** M[n n], C[n], jdqd[m] at t, q, qd, modes, u; C at lambda too where there is `loads`. */
    void (*motion)(const kempe_arguments *at, double *M, double *C, double *jdqd);
    /** Values of the conditions, all arguments. */
    void (*changes)(const kempe_arguments *at, double *value);
    /** Outputs of the model, all arguments. */
    void (*show)(const kempe_arguments *at, double *y);
    /** Changes along a direction of dynamics[n] = M qdd + C - J' lambda, h[m], of the rates J qd + h_t [m], of the
     * accelerations J qdd + jdqd [m], of the outputs and of the values of conditions. NULL: not generated. */
    void (*along)(const kempe_arguments *at, const kempe_direction *direction, double *dynamics, double *h,
                  double *rates, double *accelerations, double *y, double *value);
    /** dC/dlambda [n m]. NULL: C does not depend on lambda. */
    void (*loads)(const kempe_arguments *at, double *slopes);
    const kempe_slopes *slopes; /* of some choices of coordinates; for others they follow from M, C, J */
    int slopes_count;
    int early; /* values of conditions are functions only of t, q, qd, modes, u */
    /* m and n strings of n characters: '0' where an entry of J or M is zero at all states; NULL: none is known. */
    const char *const *jacobian_zeros, *const *mass_zeros;
    int switches;   /* closures read modes */
    double longest; /* step, s, by pulses in functions of time; 0: any */

    kempe_discrete discrete;
    const kempe_friction *friction; /* NULL: there is none */
    const kempe_charts *charts;     /* NULL: there are none */
    const kempe_watch *watch;       /* of the conditions; NULL: there are none */
} kempe_equations;

typedef enum kempe_simulator_status {
    KEMPE_SIMULATOR_GOES,
    KEMPE_SIMULATOR_ENDED, /* a condition of the model, or `end` of the settings, ends the motion: see the message */
    KEMPE_SIMULATOR_FAILED /* see the message; the state is that before the call */
} kempe_simulator_status;

typedef enum kempe_simulator_method { KEMPE_METHOD_DOP853, KEMPE_METHOD_DOPRI5, KEMPE_METHODS } kempe_simulator_method;

typedef struct kempe_simulator_work {
    double steps, rejected, evaluations, closings, exchanges, events;
} kempe_simulator_work;

/** Settings: may be changed between calls. kempe_simulator_init sets DOP853, rtol 1e-8, atol 1e-8 and no bounds. */
typedef struct kempe_simulator_settings {
    kempe_simulator_method method;
    double rtol, atol; /* atol: in scaled units, times the size of each coordinate */
    double fixed_step; /* s; 0: by the estimated error */
    double longest;    /* step, s; 0: any */
    double end;        /* s: no step goes beyond it, where the motion ends; INFINITY: none */
    double most_steps; /* of one kempe_simulator_advance; 0: 1e6 */
} kempe_simulator_settings;

/** A simulator. The arrays are in the memory of the caller and are only to be read, except p and u. */
typedef struct kempe_simulator {
    const kempe_equations *equations;
    kempe_simulator_settings settings;
    double t;
    double *p;                         /* parameters, and inputs, three each: the next call that advances takes */
    double *u;                         /* changes; kempe_simulator_set_inputs shows their effect at once */
    double *q, *qd, *qdd, *lambda, *y; /* at t */
    char
        message[320]; /* the last failure or end as a sentence, or a condition of validity that is violated, once; "" */
    kempe_simulator_work work;
    double *memory;                /* all numbers of the simulator */
    int numbers;                   /* of it */
    struct kempe_simulator_parts { /* places in the memory */
        double *modes, *k, *value, *x, *rates;
        double *state; /* what kempe_simulator_save copies: the first numbers of the memory */
        double *scratch;
        /* of the state, after it the room of one more */
        double *held, *held_p, *flip, *last, *repeats, *largest, *most, *number, *was, *due, *begin, *end, *y_old,
            *y_new, *weight, *atol, *stages, *vectors;
        int *row, *column;
        double *decisions;                                              /* on friction */
        double *chart, *seen, *seen_t, *inner_q, *inner_qd, *inner_qdd; /* of spherical joints */
        /* scratch */
        double *backup, *stage, *candidate, *probe, *aside, *q, *qd, *qdd, *lambda, *changes, *next, *watched;
        double *h, *h_t, *jdqd, *jacobian, *mass, *bias, *loop, *tangent, *constant, *correction;
        double *moved, *reduced, *diagonal, *udd, *load, *pick, *pivots, *loads, *joint, *right, *inverse_row;
        double *dq, *dqd, *dqdd, *dlambda, *dynamics, *dh, *drates, *daccelerations, *dy, *dvalue, *zero;
        double *site_q, *site_qd, *site_room, *last_pivot, *next_seen, *seen_q;
        int *pivot, *joint_pivot, *new_row, *new_column, *fixed;
        int *block, *touch_begin, *touch, *mass_begin, *mass_at, *row_mark, *column_mark;
        int rank;                   /* rows of the choice */
        int blocks;                 /* of the loops of the choice */
        const kempe_slopes *slopes; /* for the choice; NULL: the equations have none */
        double *end_of_memory;
    } part;
} kempe_simulator;

/* Numbers of a state: the header, the arrays of a place and of a step, n + f numbers long, and the choice. */
#define KEMPE_SIMULATOR_STATE(n, m, f, inputs, parameters, kept, conditions, outputs, discrete)                        \
    (48 + 2 * (parameters) + 6 * (inputs) + (kept) + (outputs) + 7 * (conditions) + 3 * (discrete) + 10 * (n) +        \
     4 * (m) + 28 * ((n) + (f)))

/** The number of doubles in the memory of a simulator, as a constant where the arguments are constants. */
#define KEMPE_SIMULATOR_MEMORY(n, m, f, inputs, parameters, kept, conditions, outputs, discrete)                       \
    (2 * KEMPE_SIMULATOR_STATE(n, m, f, inputs, parameters, kept, conditions, outputs, discrete) + 49 +                \
     20 * ((n) + (f)) + 4 * (f) + (discrete) + 3 * ((n) + (f)) + (outputs) + 3 * (conditions) + 3 * (inputs) +         \
     (parameters) + 17 * (n) + 12 * (m) + 2 + 2 * (m) * (n) + 3 * (n) * (n) + (n) * (f) + (f) * (f) + 3 * (f) + 1 +    \
     (n) * ((n) - (f)) + ((n) - (f)) * ((n) - (f)) + ((n) - (f)) * (2 * (f) + 3))

/* Friction that sticks: numbers of its state, past and present; numbers of a decision. */
#define KEMPE_SIMULATOR_FRICTION_STATE(elements)            (8 + 24 * (elements))
#define KEMPE_SIMULATOR_FRICTION_ROOM(conditions, elements) ((elements) * (6 * (elements) + 60) + (conditions))

/** Numbers that friction that sticks adds to the memory of a simulator: its state twice, rows held, and decisions. */
#define KEMPE_SIMULATOR_FRICTION(n, m, f, conditions, elements)                                                        \
    (2 * KEMPE_SIMULATOR_FRICTION_STATE(elements) + KEMPE_SIMULATOR_FRICTION_ROOM(conditions, elements) + 2 * (n) +    \
     1 + (elements) * ((n) + 2 * ((n) - (f)) + (elements) + 2 * (f) + 3))

/** Numbers that rigid contacts add to it. */
#define KEMPE_SIMULATOR_CONTACTS(n, elements) ((elements) * (2 * (n) + 4) + (n))

/** Numbers that spherical joints add to it: their charts, the angles seen and where, and the motion in the charts,
 * twice. */
#define KEMPE_SIMULATOR_CHARTS(n, joints) (2 * (12 * (joints) + 1 + 3 * (n)) + 3 * (joints) + (n))

/** Numbers that bounds of conditions add to it. `values`: constants, inputs and operations. */
#define KEMPE_SIMULATOR_WATCH(conditions, values, inputs, solved)                                                      \
    (4 * (values) + (values) / 8 + 33 * ((conditions) + 2 * (inputs) + (solved)) + 5 * (conditions) + (solved) + 3)

/** The same of equations: the number of doubles in the memory of a simulator. */
int kempe_simulator_memory(const kempe_equations *equations);

/** Places a simulator in the memory, with parameters and inputs of the model. */
void kempe_simulator_init(kempe_simulator *s, const kempe_equations *equations, double *memory);

/** Starts at t from the model's start, which moves with the parameters, at the present parameters and inputs: closes
 * the loops, chooses coordinates, decides conditions. FAILED: the loops cannot be closed. */
kempe_simulator_status kempe_simulator_start(kempe_simulator *s, double t);
/** The same at given coordinates q and rates qd (n each; NaN: not given, NULL: none is) in place of the model's. As
 * many given ones as can be independent keep their values, and the loops are closed by the others. FAILED: a given
 * value that follows from others is off by more than 1e-3 of its scale, or the loops cannot be closed there. */
kempe_simulator_status kempe_simulator_start_from(kempe_simulator *s, double t, const double *q, const double *qd);

/** Takes changes of p and u, which act from t on: steps that were made beyond t are made again, and the arrays are
 * those after the change. FAILED: an input is not finite, or the loops do not close with the new parameters; p and u
 * are then those before. Parameters that are fixed change before a start. */
kempe_simulator_status kempe_simulator_set_parameters(kempe_simulator *s);
/** The same. FAILED for an input that moves a closure: it is constant between calls, and a change would be a jump. An
 * integrator of the caller follows it by kempe_simulator_set_states. */
kempe_simulator_status kempe_simulator_set_inputs(kempe_simulator *s);

/** Takes changes of p and u as well, which act from the present time on. Advances to t and sets q, qd, qdd, lambda, y
 * there. Steps do not depend on the times that are requested. ENDED: they belong to an earlier end. FAILED: t lies
 * before the present time. */
kempe_simulator_status kempe_simulator_advance(kempe_simulator *s, double t);
/** Advances to the end of the next step. */
kempe_simulator_status kempe_simulator_step(kempe_simulator *s);

/** Saving and restoring: numbers of a state, copied as they are. The motion that follows has the same bits, here and in
 * another simulator of the same equations. No numbers: this one saves no states. */
int kempe_simulator_saved_numbers(const kempe_simulator *s);
void kempe_simulator_save(const kempe_simulator *s, double *to);
void kempe_simulator_restore(kempe_simulator *s, const double *from);

/* -- for an integrator of the caller: x has the f independent coordinates, then their f rates -----------------------
 */

void kempe_simulator_get_states(const kempe_simulator *s, double *x);
/** Sets t and x, takes the present u, then closes the loops and evaluates accelerations, multipliers and outputs, with
 * the conditions as they are. FAILED: the loops cannot be closed there; the simulator is as before. */
kempe_simulator_status kempe_simulator_set_states(kempe_simulator *s, double t, const double *x);
/** Derivatives of x at the present state. */
void kempe_simulator_get_rates(const kempe_simulator *s, double *dx);
/** Values of the conditions: an event is a change of sign. A condition that ends or switches is never zero here. */
void kempe_simulator_get_changes(const kempe_simulator *s, double *value);
/** The message names the conditions of validity that the present state violates, each once; "" without any. */
void kempe_simulator_report(kempe_simulator *s);
/** The time of the next sample of a state, at which kempe_simulator_update is to be called; INFINITY: there is none. */
double kempe_simulator_next_time(const kempe_simulator *s);
/** 1 where kempe_simulator_update is due at the end of a step: the choice of independent coordinates is bad here, or a
 * condition has changed unseen. An integrator that searches changes of sign overlooks a value that is zero before. */
int kempe_simulator_wants_update(const kempe_simulator *s);
/** Decides the conditions again at the present state, takes samples of states, and exchanges the choice where it is
 * bad; *changed: 1 where x has other values or meanings, or its rates jump. ENDED: a condition ends the motion. */
kempe_simulator_status kempe_simulator_update(kempe_simulator *s, int *changed);
/** The independent coordinates: f numbers. */
void kempe_simulator_get_choice(const kempe_simulator *s, int *independent);

/** The states along a change of parameters: they stay as they are, or they belong to a start of the model,
 * or to a start from given coordinates, which follow from t, parameters and inputs. */
enum { KEMPE_CHANGE_HERE, KEMPE_CHANGE_START, KEMPE_CHANGE_START_FROM };

/** Exact changes of the states, their derivatives dx and outputs y (and of q, qd, qdd, lambda; each may be NULL) along
 * a change of t, states x (2 f; in addition to the modes of a start), parameters, inputs u (3 each; each of these may
 * be NULL: 0), at the present state. Start values that are expressions of parameters are differentiated by differences
 * of sixth order. FAILED: equations without `along`, or a start where angles of a spherical joint are near to singular,
 * or whose deformations are in balance with its loads. */
typedef struct kempe_simulator_change {
    int start;                        /* KEMPE_CHANGE_HERE, .. */
    const double *given_q, *given_qd; /* of KEMPE_CHANGE_START_FROM: as kempe_simulator_start_from had them */
    double t;
    const double *x, *p, *u;
    double *dx, *q, *qd, *qdd, *lambda, *y, *value, *states;
} kempe_simulator_change;
kempe_simulator_status kempe_simulator_along(kempe_simulator *s, const kempe_simulator_change *change);

#ifdef __cplusplus
}
#endif
#endif
