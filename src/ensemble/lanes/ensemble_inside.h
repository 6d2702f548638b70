/* SPDX-License-Identifier: BSD-3-Clause */
/* Internals of an ensemble: an engine for each thread. Its instances wait in pools, one for each choice of independent
 * coordinates and order of elimination, and pass through the lanes of one pool at a time. No result depends on the
 * other instances of a chunk, nor on the chunks before it. */
#pragma once

#include "backend/lanes.h"
#include "constraints/partition/rank_margin.h"
#include "constraints/partition/reduction.h"
#include "constraints/programs/reduced_program_inside.h"
#include "constraints/programs/saddle_program.h"
#include "constraints/tolerances.h"
#include "ensemble/lanes/ensemble_run.h"
#include "integrators/decide/closing.h"
#include "integrators/decide/endless_growth.h"
#include "integrators/run/events.h"
#include "integrators/run/runner.h"
#include "integrators/run/work_bound.h"
#include "integrators/steppers/rk.h"
#include "model/data/variant.h"
#include <stdatomic.h>

struct kmp_dop853_step;

enum {
    /* Bounds of the lanes; beyond them: separate runs. Lanes of a tree of 29 coordinates are 1.4 times as fast as
     * these, of 40 coordinates 0.9 times; with closures a right-hand side of separate runs takes more. */
    KMP_LANE_ROWS = 127,
    KMP_LANE_TREE = 32,
    KMP_LANE_FREEDOMS = KMP_REDUCED_PROGRAM_MOST,
    KMP_POOLS_KEPT = 64 /* beyond them, an idle one makes room for a new one */
};

/** Numbers of a system that depend on the values of an instance: parameters, scales of coordinates, of rows. */
typedef struct kmp_system_constants {
    double *numbers; /* parameters + n + m */
    double length, reach;
} kmp_system_constants;

/** Signs of the blocks of Jv: one bit for each. */
enum { KMP_SIGN_WORDS = (KMP_LANE_ROWS + 64) / 64 };
typedef struct kmp_lane_signs {
    bool known;
    uint64_t negative[KMP_SIGN_WORDS];
} kmp_lane_signs;

/** An instance between its steps, outside the lanes. */
typedef struct kmp_instance {
    /* each step has these */
    bool rejected;        /* as in struct kmp_rk */
    bool again;           /* the present step is made again up to an event */
    bool has_slope;       /* dy is f(t, y) */
    bool has_step;        /* h is the next step, otherwise it is chosen */
    int tries;            /* failed attempts since the last accepted step */
    int hopeless;         /* as in struct kmp_rk */
    int next;             /* in the queue of its pool; -1: the last one */
    kmp_lane_signs signs; /* of the blocks of Jv since the start or the last exchange, where it left a lane */
    double *base;         /* of its sines (kmp_lanes_get_base), of `base_size` numbers; both as the signs */
    size_t base_size;
    kmp_work_bound bound;
    kmp_growth growth;
    double limit;               /* |Bvu| at which an exchange is due */
    double pivot, usual;        /* largest values so far of the least pivots of Jv and of the last pivots of J */
    double seen_margin, seen_t; /* of the last step's end; seen_t -1: none */
    double next_sample;         /* of its states; INFINITY: none */
    double pace;                /* the proposed step, if steps that end at samples are shorter; 0: they are not */

    kmp_last_correction corrected; /* of v, in weights */
    double t, h, error_old;
    double rate_scale;
    double kinetic, potential; /* at the start */
    kmp_present_inputs inputs; /* during its present step */
    double *y, *dy;            /* size */
    double *vdd;               /* n + m: accelerations of v there and multipliers, where conditions need them */
    double *nu;                /* m: multipliers there, where forces depend on them */
    double *mode;              /* of each condition */
    kmp_condition_past *past;  /* the same */
    void *memory;              /* of its past at the site (kmp_runner_keep_memory) */
    bool stood;                /* it has begun there */
    kmp_system_constants constants;
} kmp_instance;

/** One choice of u and of independent rows with one order of elimination. */
typedef struct kmp_lane_group {
    kmp_partition part;
    kmp_reduction red;
    int *order; /* r */
    kmp_program *program;
    kmp_lanes *lanes;
    kmp_reduced_program_layout layout;
    int slopes;                 /* the stage that has them */
    bool timed;                 /* it takes the time or inputs */
    kmp_lanes_output *output;   /* of that stage */
    double **place;             /* of each unknown in the program; NULL: it does not have it */
    kmp_eliminated *row;        /* of multipliers */
    unsigned char *pivot_block; /* block of each pivot of Jv */
    int *load_row;              /* layout.loads: rows whose multipliers forces depend on */
    kmp_saddle_program_layout completing;
    kmp_program
        *complete; /* accelerations and multipliers of q and qd, for quantities of them (kmp_saddle_program_write) */
    kmp_lanes *complete_lanes; /* NULL: it is not needed, or there is none */
    int head, tail, waiting;   /* instances; -1: none */
    unsigned long used;        /* the find that gave it last */
} kmp_lane_group;

/** Instances of a run that have come to their end, of all engines. */
typedef struct kmp_ensemble_done {
    atomic_long done;
    long total;
} kmp_ensemble_done;

/** The lanes of the current pool: vectors have width doubles per component. */
typedef struct kmp_lane_state {
    size_t w;
    int who[KMP_LANES_MOST]; /* instance, -1: none */
    double t[KMP_LANES_MOST], h[KMP_LANES_MOST], t_new[KMP_LANES_MOST], error[KMP_LANES_MOST];
    double step[KMP_LANES_MOST];
    double until[KMP_LANES_MOST],
        limit[KMP_LANES_MOST]; /* ends of the inputs' pieces; times that no step goes beyond */
    double error_old[KMP_LANES_MOST], next[KMP_LANES_MOST]; /* of the last accepted step; the step after this one */
    /* attempts that need no decision of the instance: the most; accepted and rejected ones not yet in its account */
    int64_t spare[KMP_LANES_MOST], made[KMP_LANES_MOST], repeated[KMP_LANES_MOST];
    int64_t rejected[KMP_LANES_MOST], tries[KMP_LANES_MOST]; /* those of the instances */
    bool gaps;                                               /* some lane has no instance */
    double bad[KMP_LANES_MOST];                              /* not 0: the right-hand side cannot be evaluated */
    double pivot[KMP_LANES_MOST], exchange[KMP_LANES_MOST];  /* those of the instances: pivot, limit */
    uint64_t negative[KMP_SIGN_WORDS * KMP_LANES_MOST];      /* theirs, word by word */
    double *y, *y_new, *stage, *weight, *atol;               /* size: room for the largest */
    double *k[17];                                           /* size, as published: 1 to 13; for dense output to 16 */
    double *scale;                                           /* n */
    double *row_scale;                                       /* m */
    double *per_scale, *per_row_scale;                       /* n, m: reciprocal */
    double *square;                                          /* m x n, of one lane */
    double *vdd, *vdd_new, *vdd_middle;                      /* n + m, where conditions need them */
    bool late;                                               /* conditions depend on accelerations or multipliers */
    double *nu, *nu_now, *nu_end; /* m, where forces depend on multipliers: from which they are solved for, at the last
                                   * evaluation, at the end of the step */
    double event[KMP_LANES_MOST]; /* time of one within the step */
    bool dense_bad[KMP_LANES_MOST];     /* the dense output of the present step is not available */
    double *at;                         /* time of an evaluation, then the inputs there */
    bool anew;                          /* the slope of some lane is to be evaluated again */
    int out[KMP_LANES_MOST], out_count; /* instances that have left for a separate run */
} kmp_lane_state;

enum { KMP_LANE_VECTORS = 8 }; /* of the interpolant */

/** The lane whose states within its present step are asked for. */
typedef struct kmp_lane_within {
    kmp_lane_group *pool;
    size_t lane;
    bool current;                     /* its instance is the current one */
    bool ready;                       /* the interpolant is known */
    double *vector[KMP_LANE_VECTORS]; /* size: the interpolant */
    double *y, *udd;                  /* size: unknowns; their second derivatives */
} kmp_lane_within;

typedef struct kmp_lane_conditions kmp_lane_conditions;

/** One thread's share of an ensemble: a system of its own and its lanes. It runs one chunk of instances after another.
 */
struct kmp_measuring;

typedef struct kmp_engine {
    kempe_context *context; /* the model's, or its own, which reports no progress */
    bool own_context;
    kmp_variant *variant;
    kempe_system *s;
    int n, m, parameters;
    int p, r, size;           /* of the pool in the lanes */
    int columns;              /* number of names */
    kmp_system_constants own; /* of the model's own values */

    /* of a run */
    kmp_run_spec spec;
    kmp_ensemble_execution execution;
    kmp_ensemble_done *all;
    kmp_evaluator *eval;
    double *state;                 /* 4 n: of the current instance */
    kmp_lane_group **pools;        /* a list */
    const kmp_lane_group *running; /* NULL: none */
    unsigned long finds;
    kmp_arena run_arena;   /* of the lanes and the state */
    kmp_partition swapped; /* room for one */
    kmp_lane_state room;
    kmp_ensemble_work work;
    int pool_count;
    struct kmp_measuring *measuring; /* of quantities; NULL: there are none */
    kmp_lane_within within;
    kmp_lane_conditions *conditions; /* NULL: there are none */
    kmp_lanes *beside[2];            /* programs of quantities and conditions in lanes; NULL: there is none */
    kmp_runner *site;                /* where instances stand between steps; NULL: nothing happens to them there */
    void *fresh;                     /* the memory of a motion that begins */

    /* of a chunk */
    int count;
    const double *values; /* count x columns */
    kmp_arena arena;      /* of the instances and their arrays */
    kmp_instance *instances;
    kmp_ensemble_result *results;
    double *q, *qd; /* count x n */
    double *taken;  /* count x values of the quantities; NULL: there are none */
} kmp_engine;

/* ensemble_engine.c */

/** An engine for a model with variable parameters; `apart`: with a context of its own, below that of the model. */
kempe_status kmp_engine_new(const kempe_model *model, int count, const char *const *names, bool apart,
                            kmp_engine **engine);
void kmp_engine_free(kmp_engine *engine);

/** Begins a run with a resolved spec and a given number of lanes, and ends it. */
kempe_status kmp_engine_begin(kmp_engine *engine, const kmp_run_spec *spec, const kmp_ensemble_execution *execution,
                              kmp_ensemble_done *all);
void kmp_engine_end(kmp_engine *engine);

/** Runs a chunk: `count` rows of values, their results, q and qd. */
kempe_status kmp_engine_run(kmp_engine *engine, int count, const double *values, kmp_ensemble_result *results,
                            double *q, double *qd);

/** Keeps the constants of the system, and restores them. */
void kmp_constants_keep(const kempe_system *s, kmp_system_constants *constants);
void kmp_constants_take(kempe_system *s, const kmp_system_constants *constants);

/** Counts an instance that has come to its end. */
void kmp_engine_count(kmp_engine *engine);

/* ensemble_start.c: one instance at a time. Statuses concern the whole ensemble: memory. */

/** Reason why lanes can run no instance; NULL: they can. */
const char *kmp_engine_no_lanes(const kmp_engine *e);

/** Assembles an instance and puts it into a pool, or leaves it to a separate run, or writes its failure. */
kempe_status kmp_instance_start(kmp_engine *e, int i);
/** Makes the next choice of u of an instance, from t and y. */
kempe_status kmp_instance_exchange(kmp_engine *e, kmp_lane_group *from, int i);
/** The same for one degree of freedom, from y and dy alone: u becomes dependent, and v[k] independent. */
kempe_status kmp_instance_swap(kmp_engine *e, kmp_lane_group *from, int i, int k);
/** Goes on with the choice of u of an instance from e->state at its time. */
kempe_status kmp_instance_resume(kmp_engine *e, kmp_lane_group *from, int i);
/** Makes the next choice of independent rows of an instance, from t and y. */
kempe_status kmp_instance_change_rows(kmp_engine *e, kmp_lane_group *from, int i);
/** Keeps the choice of u of an instance with another order of elimination that is good at t and y. */
kempe_status kmp_instance_reorder(kmp_engine *e, kmp_lane_group *from, int i);
/** Writes the result of an instance, from t and y. */
kempe_status kmp_instance_finish(kmp_engine *e, kmp_lane_group *pool, int i);
/** Takes an instance out of the lanes for a separate run. */
void kmp_instance_leave(kmp_engine *e, int i, const char *why);

/** Puts the values of an instance into the model. KEMPE_E_INPUT: they are impossible, and its result says why. */
kempe_status kmp_instance_take_values(kmp_engine *e, int i);
/** Takes the values of an instance, assembles it, and measures its energies: KEMPE_E_INPUT, or the status of the
 * assembly. */
kempe_status kmp_instance_assemble(kmp_engine *e, int i, kempe_assembly **a);

/** Puts q and qd of an instance in the unknowns of a pool into e->state, with factors and tangent, closed on request.
 * false: Jv is singular, and the instance is left to a separate run. */
bool kmp_instance_unpack(kmp_engine *e, kmp_lane_group *pool, int i, bool closed);

/** True if no joint's angles are nearer to their singular position than this, or the user keeps them. */
bool kmp_instance_has_angles(const kmp_engine *e, const double *q, double least);

/** Goes on from (q, qd) at x->t with another partition, which it frees; `status`: of its choice. */
kempe_status kmp_instance_go_on(kmp_engine *e, int i, kempe_status status, kmp_partition *part, const double *q,
                                const double *qd);
/** Measures the end of an instance; the evaluator's closure is that of q. */
void kmp_instance_judge(kmp_engine *e, int i, double t, const double *q, const double *qd, double work);

/** Makes an instance that was current before current again. */
void kmp_instance_current(kmp_engine *e, const kmp_instance *x);

/** Computes q and qd at a time from unknowns y of a pool for the present constants, with factors and tangent, on closed
 * loops if `closed`. false: Jv is singular. */
bool kmp_instance_state(kmp_engine *e, kmp_lane_group *pool, double t, const double *y, double *q, double *qd,
                        bool closed);

/* ensemble_within.c: states within the present step of a lane */

#define KMP_LANE_SINGULAR_ANGLES "a spherical joint near the singular position of its angles"
#define KMP_LANE_NO_STATES       "states between steps that are not available"

/** Makes what an engine needs for them; false: no memory. */
bool kmp_within_init(kmp_engine *e);

/** Takes up a lane whose stages are all known. kmp_within_is_exact: false if its interpolant is less exact than the
 * step, where a run would integrate anew. */
void kmp_within_begin(kmp_engine *e, kmp_lane_group *pool, size_t lane);
bool kmp_within_is_exact(kmp_engine *e);

/** Makes the instance of that lane the current one with the inputs of its step, if it is not; then takes these back. */
void kmp_within_stand(kmp_engine *e);
void kmp_within_end(kmp_engine *e);

/** The state at t within the step of that lane: q, qd, and, if `rates`, qdd and lambda. false: it is not available. */
bool kmp_within_state(kmp_engine *e, double t, bool rates, double *q, double *qd, double *qdd, double *lambda);

/** Accelerations and multipliers (NULL: not wanted) of a state of a pool, after kmp_instance_state. */
bool kmp_instance_complete(kmp_engine *e, kmp_lane_group *pool, const double *qd, double *qdd, double *lambda);

/** Gives the evaluator the inputs of a step; NULL: takes them back. */
void kmp_engine_hold_inputs(kmp_engine *e, const kmp_present_inputs *inputs);

/* ensemble_conditions.c: conditions of instances */

/** Reason why lanes cannot watch the conditions of a system; NULL: they can. */
const char *kmp_conditions_no_lanes(const kempe_system *system);

/** Makes what an engine needs for them; false: no memory. */
bool kmp_conditions_init(kmp_engine *e);

/** Sets the conditions of the current instance by its start. false: one ends the run there. */
bool kmp_instance_begin_conditions(kmp_engine *e, kmp_instance *x, const double *q, const double *qd);

/** The crossing for the current instance; NULL: there are no conditions. */
kmp_event_tracker *kmp_instance_crossing(kmp_engine *e, kmp_instance *x);

/** True if some condition depends on accelerations or multipliers. */
bool kmp_has_late_conditions(const kempe_system *system);

/** Keeps the evaluator's conditions as those of the current instance. */
void kmp_instance_keep_modes(const kmp_engine *e, kmp_instance *x);

/** Gives the programs of a lane the conditions of its instance. */
void kmp_lane_set_modes(kmp_engine *e, kmp_lane_group *pool, size_t lane);

/** The watch of the conditions of a lane; NULL: there are none. */
kmp_event_tracker *kmp_lane_watching(const kmp_engine *e, size_t lane);

/** Takes the lane of kmp_within_begin to its event: the instance then has the time and the work there, e->state the
 * closed state. `pass`: the conditions change, and the instance has them; false: they change without end. Otherwise the
 * state is that before they change; false: it is not available. */
bool kmp_lane_visit_event(kmp_engine *e, double t, bool pass);

/* ensemble_watch.c: tests at the end of steps */

/** Values of a pool's last stage at the end of the present steps, by lanes. */
typedef struct kmp_lane_watched {
    const double *multiplier, *pivot, *h, *jacobian, *b, *dv;
    bool has_jacobian; /* J is there, too */
    double residual[KMP_LANES_MOST], correction[KMP_LANES_MOST], growth[KMP_LANES_MOST], least[KMP_LANES_MOST];
    double margin[KMP_LANES_MOST]; /* over its usual size; infinite: far from any change point */
    double rows[KMP_LANES_MOST];   /* largest dependence of a dropped row on the kept ones; 0: small */
    uint64_t negative[KMP_SIGN_WORDS * KMP_LANES_MOST]; /* signs of the blocks of Jv (kmp_lanes_signs) */
    int64_t
        quiet[KMP_LANES_MOST]; /* v is corrected, and neither pivots nor |Bvu| nor a limit of time need a decision */
} kmp_lane_watched;

/** Runs the last stage of a pool, and measures it. */
void kmp_lanes_watch(kmp_engine *e, kmp_lane_group *pool, kmp_lane_watched *x);

/** The pivots of Jv among the outputs of the last stage. */
const double *kmp_lanes_pivots(const kmp_engine *e, const kmp_lane_group *pool, const double *end);
/** True if the formulation accepts a step (accept of reduced.c): the closures corrected, the choice of u and the margin
 * good. */
bool kmp_lane_consents(kmp_engine *e, const kmp_lane_group *pool, kmp_lane_watched *x, size_t l);

/** True if another order of elimination is due. */
bool kmp_lane_order_is_bad(const kmp_engine *e, const kmp_lane_group *pool, const kmp_lane_watched *x, size_t l);

/** True if a run would step across a change point here (watch_margin of runner_change.c). */
bool kmp_instance_nears_change(kmp_instance *x, double t, double h, double margin);

/* ensemble_site.c: what happens to one instance between its steps, as in a run */

#define KMP_LANE_SMOOTH "friction that is regularised for a time"

/** Makes the site of an engine if its system needs one. */
kempe_status kmp_site_init(kmp_engine *e);

/** Begins the current instance at the site: e->site has the state, its accelerations and rows. KEMPE_E_FAILED: a run
 * would fail as well. */
kempe_status kmp_instance_restart(kmp_engine *e, kmp_instance *x, const kempe_assembly *a);

/** Passes the `event` that was looked at, or samples and jumps of inputs, of an instance in the unknowns of a pool, at
 * x->t, `since` the beginning of its step, and the closed state in e->state; the evaluator has its conditions and
 * inputs. Then puts it into a pool, or leaves it to a separate run. */
kempe_status kmp_instance_pass(kmp_engine *e, kmp_lane_group *from, int i, bool event, double since);

/** The same of samples and jumps of inputs, from x->y. */
kempe_status kmp_instance_meet(kmp_engine *e, kmp_lane_group *from, int i);

/* ensemble_measure.c: quantities of instances */

/** Makes what an engine needs for the quantities of its run, and the accounts of a chunk. false: no memory. */
bool kmp_measuring_init(kmp_engine *e);
bool kmp_measuring_chunk(kmp_engine *e);

/** Begins the account of an instance at its start. */
void kmp_instance_begin_account(kmp_engine *e, int i);

/** True if the dense output of steps is needed. */
bool kmp_measures_steps(const kmp_engine *e);

/** Makes the program of a pool that quantities of accelerations and multipliers need. false: no memory. */
bool kmp_lane_group_complete(kmp_engine *e, kmp_lane_group *pool);

/** Rows of all lanes, q then qd, from the unknowns and their slopes. */
void kmp_lanes_spread(const kmp_engine *e, const kmp_lane_group *pool, const double *y, const double *slope,
                      double *rows);

/** Takes the last step of a separate run into account. false: some state within it is not
 * available. */
bool kmp_run_measure(kmp_engine *e, int i, kmp_runner *run);

/** Writes the quantities at the end of an instance, at q and qd on closed loops; `row`: q, qd, qdd, lambda there, NULL:
 * not known. `pool`: of its lane. */
void kmp_instance_measured(kmp_engine *e, kmp_lane_group *pool, int i, double t, const double *row);

/* ensemble_apart.c: separate runs. */

/** Repeats an instance in a separate run from its start. */
kempe_status kmp_instance_alone(kmp_engine *e, int i);
/** Continues an instance from t and y in a separate run, until lanes can take it back or to its end. `margin`: that of
 * the closures over its usual size; 0: the run finds it. If such a run fails, the instance is left to one from its
 * start. The second begins such a run at a state with closures of this rank. */
kempe_status kmp_instance_apart(kmp_engine *e, kmp_lane_group *from, int i, double margin, const char *why);
kempe_status kmp_instance_start_apart(kmp_engine *e, int i, int rank, double margin, const double *q, const double *qd,
                                      double work, const char *why);

/* ensemble_pool.c */

/** Finds the pool of a partition; Jv at the evaluator's last closure determines the order of elimination. NULL in
 * *pool: its program cannot be written. */
kempe_status kmp_lane_group_find(kmp_engine *e, const kmp_partition *part, kmp_lane_group **pool);
/** The first pool of a partition in any order of elimination; NULL: there is none. */
kmp_lane_group *kmp_lane_group_of_choice(kmp_engine *e, const kmp_partition *part);
/** True if a pool has the only order of elimination of its partition. */
bool kmp_lane_group_is_ordered(const kmp_lane_group *pool);
void kmp_lane_group_free(kmp_lane_group *pool);
/** True if an engine has a pool of the same choice and order. */
bool kmp_lane_group_among(const kmp_engine *e, const kmp_lane_group *pool);
void kmp_lane_group_put(kmp_engine *e, kmp_lane_group *pool, int i);
int kmp_lane_group_take(kmp_engine *e, kmp_lane_group *pool);

/* ensemble_room.c, ensemble_lanes.c */

/** Gives one instance's numbers of a kind to all programs of a lane: of the pool, of quantities, of conditions. */
void kmp_lane_give(kmp_engine *e, const kmp_lane_group *pool, kmp_input_kind kind, size_t lane, const double *x);

/** The largest number of unknowns in lanes. */
static inline int kmp_lane_most(const kmp_engine *e)
{
    return 2 * e->n + e->s->dissipative;
}

/** Makes the lanes of an engine, in the arena of its run. false: no memory. */
bool kmp_lane_state_init(kmp_engine *e, int width);

/** Runs a pool until it is empty, or until another has more to do. */
kempe_status kmp_lane_group_run(kmp_engine *e, kmp_lane_group *pool);

/* ensemble_kernels.c: the arithmetic of DOP853 on vectors of lanes, in the order of operations of dop853.c, with fused
 * multiply-adds */

/** out = y + h sum a[j] k[j]; h has one value per lane. A component with a place is written there, too. */
typedef struct kmp_lanes_sum {
    const double *y, *h;
    int terms;
    const double *a;
    const double *const *k;
    double *out, *const *place;
} kmp_lanes_sum;

/** For vectors of `size` components. */
void kmp_lanes_combine(size_t width, size_t size, const kmp_lanes_sum *sum);

/** Computes the solution of order 8, the error weights, and the error of each lane: 1 is at the tolerance. */
void kmp_lanes_solution(size_t width, size_t size, const struct kmp_dop853_step *step);

/** The vectors of the interpolant within the present steps: the cubic one (4), or the dense one (8), from all stages.
 */
void kmp_lanes_interpolant(size_t width, size_t size, const struct kmp_dop853_step *step, bool dense,
                           double *const *vector);
/** Its value at x, 0 to 1, in all lanes. */
void kmp_lanes_interpolate(size_t width, size_t size, int vectors, double *const *vector, double x, double *y);

/** The next steps after accepted ones, without regard to rejections before (kmp_step_after). */
void kmp_lanes_next_steps(size_t width, kmp_lane_state *room);

/** Slopes from the outputs of a program; `bad` of the room grows where they are not finite or a pivot is not positive.
 */
void kmp_lanes_publish(size_t width, kmp_engine *e, const kmp_lane_group *pool, const double *y, double *k);

/** Measures the ends of steps: max |h| and max |Bvu|, scaled; max |dv| in weights, of those beyond rounding; the least
 * |pivot| of Jv. */
void kmp_lanes_measure(size_t width, const kmp_engine *e, const kmp_lane_group *pool, kmp_lane_watched *x);

/** Finds the ends of steps that need no decision, and corrects v there. */
void kmp_lanes_find_quiet(size_t width, kmp_engine *e, const kmp_lane_group *pool, kmp_lane_watched *x);

/** Attempts of steps in all lanes. Accepted ones that need no decision give the times, step sizes and errors of the
 * next step, rejected ones the next size. */
typedef struct kmp_lane_attempts {
    double failed[KMP_LANES_MOST];                     /* not 0: a stage */
    int64_t on[KMP_LANES_MOST], stays[KMP_LANES_MOST]; /* in which lanes; in which of them the step is made again */
    bool all;                                          /* in all lanes */
    bool none_stays;
} kmp_lane_attempts;

void kmp_lanes_pass_on(size_t width, kmp_lane_state *room, const int64_t *quiet, kmp_lane_attempts *attempts);

/** Exchanges the numbers of some lanes of two vectors of `size` components. */
void kmp_lanes_exchange(size_t width, size_t size, const int64_t *lanes, double *a, double *b);

/** The steps to try, up to limits and `longest` at most (kmp_step_next); 0: it is too short, which is not 0 in *none,
 * or the lane has no instance. */
void kmp_lanes_choose_tries(size_t width, kmp_lane_state *room, double longest, int64_t *none);

/** Finds the signs of blocks from those of their pivots: in each lane KMP_SIGN_WORDS words, word k of lane l at k width
 * + l. block: that of each pivot. */
void kmp_lanes_signs(size_t width, int pivots, const unsigned char *block, const double *pivot, uint64_t *negative);
