/* SPDX-License-Identifier: BSD-3-Clause */
/* The tree of links: one link a motion, as the paper's bodies (Fisette and Samin 1996, Fig. 2: body i carried by body
 * h through a joint of one degree of freedom). Intermediate links of a joint with several motions are massless.
 *
 * Link axes are chosen so that every motion is about or along a coordinate axis: an oblique axis costs one constant
 * rotation. Link 0 is the ground. */
#pragma once

#include "dynamics/kinematics/friction_roles.h"
#include "dynamics/kinematics/vector.h"
#include "model/data/model.h"

typedef struct kmp_link {
    int parent; /* link; -1 for the ground */
    int body;   /* the body that it carries, except welded ones; -1 for an intermediate link */
    bool rotation;
    int axis;            /* 0, 1, 2 of the link's axes */
    kmp_ref q, qd;       /* of the motion, with a sign when the axis is a negative coordinate axis */
    bool reversed;       /* the sign */
    bool turned;         /* g is not the identity */
    double g[3][3];      /* v_parent = g v_link at q = 0 */
    bool stays;          /* the link's axes do not turn with the joint: vectors fixed to its body do, by `lag` */
    bool follows;        /* its parent's axes do not turn either, about the same axis: both have the same axes */
    kmp_ref lag;         /* the angle about `axis` from the link's axes to its body's; zero unless it stays */
    double a[3][3];      /* v_model = a v_link: axes of the body's model frame */
    int before, after;   /* charts: rotations in model axes before its motion and after it, -1 for none */
    kmp_ref chart[3][3]; /* g with the chart before it and the one after its parent, when there are any */
    kmp_vec p;           /* from the parent's origin to this joint's, parent's link axes (p_z without the motion) */
    kmp_ref armature;    /* a mass of its coordinate alone */
    kmp_ref mass;
    kmp_vec com;        /* l^i, link axes */
    kmp_tensor inertia; /* I^i about the com, link axes */
    kmp_composite own;  /* the mass that its wrench counts as its own, about its origin (kmp_tree_sum_up), link axes */
    bool about;         /* its wrench is computed from `own` */
    kmp_composite base; /* the mass that its composite body counts as its own */
    bool lumped;        /* the mass of all bodies it carries, and its own, is in its parent's `base` already */
    kmp_vec push;       /* body inputs: a force at the com and a torque, link axes; zero where there are none */
    kmp_vec twist;
} kmp_link;

/** The position of a body on its link; it differs from the link's origin and axes when the body is welded to another
 * one. */
typedef struct kmp_body_on_link {
    int link;
    bool turned;    /* r is not the identity */
    double r[3][3]; /* v_own = r v_body: model axes of the link's own body, from this body's */
    kmp_vec p;      /* from the link's origin to the body's, link axes */
} kmp_body_on_link;

/** A condition: a comparison or a sign in an expression, or one of an element. */
typedef struct kmp_condition {
    const void *of; /* the expression or part of the model that has it: `of` and number identify it */
    int number;
    const kmp_expr *expr; /* NULL: of an element */
    char *text;           /* of an element: its name in the log */
    bool ends;            /* runs end where its value becomes negative; it has no input */
    bool kink;            /* of abs, min or max: the active branch; both branches are equal where it changes */
    bool bend;            /* of abs, min, max or straight lines in a closure: J may jump with it */
    bool rough;           /* its change is not noted; a step that meets it is made again up to it */
    bool told;            /* an end of a table: that it is left is reported; no event, and no input */
    bool late;            /* a kink whose value depends on accelerations or multipliers */
    bool measured;        /* the log has the largest value that it had while it was true */
    kmp_role role;        /* of a friction element; otherwise KMP_ROLE_NONE */
    double lag;           /* of an element: it changes where its value has passed zero by this amount; 0: at zero */
    const char *advice;   /* where it ends runs, or prevents continuation by changing back and forth; NULL: none */
} kmp_condition;

/** The conditions of a model, numbered in the order of their creation: comparisons and signs of variable quantities. A
 * program for integration takes them as inputs KMP_IN_MODE, which are constant during a step, so that it is smooth. A
 * change of a condition is an event. */
typedef struct kmp_events {
    int count;
    kmp_condition *condition;
} kmp_events;

/** The values of elements' conditions in one graph, by number. */
typedef struct kmp_noted_value {
    kmp_ref value;
    bool known;
} kmp_noted_value;

typedef struct kmp_noted {
    int count;
    kmp_noted_value *note;
} kmp_noted;

void kmp_events_free(kmp_events *events);

/** The number of a condition by `of` and `number`, -1: none; adds one, whose text it takes, -1: no memory. */
int kmp_events_find(const kmp_events *events, const void *of, int number);
int kmp_events_add(kmp_events *events, kmp_condition condition);
void kmp_noted_free(kmp_noted *noted);

/** Arguments of tables whose points may be left, in outputs: the number of the table, the variable, its value. */
typedef struct kmp_table_use {
    int table, variable;
    kmp_ref at;
} kmp_table_use;

typedef struct kmp_table_uses {
    int count, most;
    kmp_table_use *use;
} kmp_table_uses;

/** Numbers that stay symbols, inputs KMP_IN_PARAMETER: none, the model's parameters, or with them (numbered after them)
 * every number of the model. The last is the convention by which generators are compared. Zeros of the data are zeros
 * of the equations in any case. */
typedef enum kmp_keep { KMP_KEEP_NOTHING, KMP_KEEP_PARAMETERS, KMP_KEEP_NUMBERS } kmp_keep;

/** Rows that a closure may have, at most. */
enum { KMP_CLOSURE_ROWS = 6 };

typedef struct kmp_tree {
    kmp_graph *graph;
    const kempe_model *model;
    kmp_arena arena; /* of all arrays that it owns */
    kmp_keep keep;
    double *symbols; /* KMP_KEEP_NUMBERS: values of all symbols, parameters first */
    bool charted;    /* joints of kmp_spherical_find have inputs KMP_IN_CHART */
    int count;       /* links, ground included: motion k is link k + 1 */
    kmp_link *links;
    kmp_body_on_link *mounts; /* of each body */
    kmp_vec gravity;
    const kmp_ref *place; /* 3: the values of x, y, z in expressions; NULL: they have none */
    kmp_ref *unknown;     /* KMP_UNKNOWNS_MOST for each group of the model: their values, once used; of a named
                             expression the second is that with conditions for its kinks; NULL: not kept */
    bool *solved;         /* of each group: its values are present */
    int solving;          /* whose equations are being written, from 1; 0: none */
    kmp_events *events;   /* NULL: conditions are evaluated in place */
    bool kinks;           /* abs, min and max are conditions: in laws of forces */
    bool watches;         /* places where functions begin to count are conditions: in laws and in rows of closures */
    bool bends;           /* they are conditions as comparisons are: in rows of closures, whose J jumps with them */
    bool settled;         /* no further condition becomes an event: a new one is evaluated in place */
    bool given_delays;    /* states of continuous delays have no rate */
    kmp_noted *noted;     /* of the graph; present with `events` */
    kmp_table_uses *uses; /* of outputs; NULL: they are not noted */
    /* The force or the moment of a closure by its multipliers; NULL: there are none. */
    kmp_vec (*reaction)(const struct kmp_tree *tree, int closure, bool moment);
    struct kmp_joint_loads *loads; /* of its joints (dynamics/joint_loads.h); NULL: they are not known */
    kmp_vec (*carried)(const struct kmp_tree *tree, int body, bool moment); /* the load of a body's joint, by them */
    const int *row; /* KMP_CLOSURE_ROWS per closure: the number of each declared row among those that are kept, -1 for
                       others; not owned; NULL: none is known */
} kmp_tree;

/** After the graph has returned to an earlier state: forgets all values of names and conditions that are no longer in
 * it. */
void kmp_tree_forget(kmp_tree *tree);

/** The position of a spherical joint's chart: true for before its three rotations, false for after them, by the
 * estimated cost. After them it rotates the data of the body once and each vector passed to carried bodies. Before them
 * it rotates each vector that passes the joint, where the base itself turns or a point's position is needed. */
bool kmp_tree_chart_before(const kempe_model *model, int first);

/** Sets `before` and `after` of all links, none with a chart unless the tree is charted. false: no memory. */
bool kmp_tree_place_charts(kmp_tree *tree);

/** Builds the links, except the members that kmp_tree_sum_up sets. False: no memory. */
bool kmp_tree_init(kmp_tree *tree, kmp_graph *g, const kempe_model *model, kmp_keep keep, bool charted);

/** The same links again, of a tree without inputs on its bodies. False: no memory. */
bool kmp_tree_init_again(kmp_tree *tree, const kmp_tree *from);

/** Sets each link's `own` and `base` from its mass, centre of mass and inertia. */
void kmp_tree_sum_up(kmp_tree *tree);

/** Gives every body with motions of its own three force inputs and three torque inputs. Forces act at the centre of
 * mass of all bodies welded to it. The inputs are KMP_IN_FORCE and KMP_IN_TORQUE, number 3 (body - 1) + k. Bodies named
 * in `without`, separated by commas, have none (NULL: all have). */
void kmp_tree_add_inputs(kmp_tree *tree, const char *without);

/** The number of symbols, and the values of all. */
int kmp_tree_symbol_count(const kmp_tree *tree);
void kmp_tree_symbol_values(const kmp_tree *tree, double *value);
void kmp_tree_free(kmp_tree *tree);

/** A number of the model as a node: a constant, or its expression over parameters. */
kmp_ref kmp_tree_number(const kmp_tree *tree, const kmp_number *number);
kmp_vec kmp_tree_vector(const kmp_tree *tree, const kmp_number number[3]);

/** An expression of the model language over q, qd, t and parameters as a node. */
kmp_ref kmp_tree_expression(const kmp_tree *tree, const kmp_expr *expr);

/** An expression in a row of a closure: its kinks are conditions, as rates may jump there. */
kmp_ref kmp_tree_bent(const kmp_tree *tree, const kmp_expr *expr);

/** 1 where a < b, for the comparison in expression e, and 0 elsewhere; during a step its input. */
kmp_ref kmp_tree_stated(const kmp_tree *tree, const kmp_expr *e, kmp_ref a, kmp_ref b);

/** abs(a), min(a, b) or max(a, b), for expression e. If the condition is constant during a step, the branch that its
 * input KMP_IN_MODE selects: 1 where a (a - b) is negative, -1 where it is not, 0 for the active one; of a bend 1 and
 * 0. */
kmp_ref kmp_tree_kink(const kmp_tree *tree, const kmp_expr *e, kmp_ref a, kmp_ref b);

/** Notes where exp, cosh, sinh or 1 - tanh^2 of a begins to count, for expression e of that function: a narrow pulse
 * between the places at which a step is evaluated would otherwise pass unseen. */
void kmp_tree_watch_pulse(const kmp_tree *tree, const kmp_expr *e, kmp_ref a);

/** A table of expression e at x. The knots of straight lines are kinks or bends, and so are the ends of a table that
 * holds its values there. One condition finds the knots of others, at which steps end. The ends of others are
 * conditions that end the run, or are reported. */
kmp_ref kmp_tree_table(const kmp_tree *tree, const kmp_expr *e, kmp_ref x);

/** 1 where `difference` is negative and 0 elsewhere; during a step an input KMP_IN_MODE in its place: for the laws of
 * forces and the rows of closures. `of` is the part of the model that has the condition (a kmp_force, kmp_closure,
 * kmp_wheel, ..), `number` distinguishes its conditions. Equal `of` and `number` give the same condition in any graph,
 * and the difference must be the same there. It depends on t, q and qd, and on other conditions. It changes where the
 * difference has passed zero by `lag`. `advice` is the remedy where it changes back and forth, within few lags each
 * time (NULL: the advice for laws of forces). The text describes the true condition, for the log: "wheel 'L':
 * contact in zone 2".
 *
 * Rows h of closures may switch by it to a branch of equal value; their J may jump there, and the rates with it. */
kmp_ref kmp_tree_condition(const kmp_tree *tree, const void *of, int number, kmp_ref difference, double lag,
                           const char *advice, const char *format, ...) __attribute__((format(printf, 7, 8)));

/** Runs end where `value` becomes negative, with the message: TEXT at t = .. s: ADVICE ("wheel 'L' left its rail", and
 * a possible cause or remedy; NULL: the model requests this end). `of` and `number` are as for kmp_tree_condition. The
 * value may depend on multipliers too (KMP_IN_LAMBDA), and on accelerations. It has no effect where conditions are
 * evaluated in place. */
void kmp_tree_end(const kmp_tree *tree, const void *of, int number, kmp_ref value, const char *advice,
                  const char *format, ...) __attribute__((format(printf, 6, 7)));
/** One of the model's algebraic variables, or the value of a name (KMP_EXPR_UNKNOWN). */
kmp_ref kmp_tree_unknown(const kmp_tree *tree, const kmp_expr *expr);

/** The multiplier of a closure's declared row, an input KMP_IN_LAMBDA; zero for one that is not kept, and before the
 *  closures' rows are derived. */
kmp_ref kmp_tree_multiplier(const kmp_tree *tree, int closure, int component);

/** The declared row of number k, from 0, among those that a closure keeps: lambda.CLOSURE.k+1; -1: there is none. */
int kmp_tree_kept(const kmp_tree *tree, int closure, int k);

/** A table of two variables of expression e. */
kmp_ref kmp_tree_surface(const kmp_tree *tree, const kmp_expr *e, kmp_ref x, kmp_ref y);

/** The number of the condition that an end of a table (kmp_table_end) is passed. */
int kmp_table_end_number(const kmp_named_table *table, int end);

/** The quantity that is negative where condition k, `first < second`, is true: first - second. For a and b in `a < b`
 * and `a >= b` first is a, otherwise b. For an element, the value that its law or residual has noted in this graph;
 * false: none yet. */
bool kmp_tree_event(const kmp_tree *tree, int k, kmp_ref *difference);

/** Turns v by an angle about a link's axis, when the link rotates. */
void kmp_link_turn(const kmp_tree *tree, const kmp_link *link, kmp_ref angle, kmp_vec *v);

/** Components of v in the parent's axes, from link i's, and back. */
kmp_vec kmp_link_to_parent(const kmp_tree *tree, int i, kmp_vec v);
kmp_vec kmp_link_to_child(const kmp_tree *tree, int i, kmp_vec v);

/** Entry (row, column) of the constant rotation g of link i, charts included. */
kmp_ref kmp_link_axes(const kmp_tree *tree, int i, int row, int column);

/** Tensors and matrices in the parent's axes: R t R'. */
kmp_tensor kmp_link_tensor_to_parent(const kmp_tree *tree, int i, kmp_tensor t);
kmp_matrix kmp_link_matrix_to_parent(const kmp_tree *tree, int i, kmp_matrix m);

/** The displacement of a translation along its axis, link axes; zero for a rotation (z^i of the paper). */
kmp_vec kmp_link_slide(const kmp_tree *tree, int i);

/** v of an ancestor's axes in link's. */
kmp_vec kmp_from_ancestor(const kmp_tree *tree, int link, int ancestor, kmp_vec v);

/** The angular velocity of vectors fixed to a link relative to the axes of an ancestor, in those axes. The ancestor's
 * axes may be non-rotating. */
kmp_vec kmp_link_spin(const kmp_tree *tree, int link, int ancestor);

/** The inputs KMP_IN_TIME whose derivatives by t equations need, and these derivatives: of t, and of the inputs of the
 * model. No equation needs a third derivative of an input. The number of them. */
static inline int kmp_tree_time_leaf_count(const kmp_tree *tree)
{
    return 1 + (KMP_TIME_NUMBERS - 1) * tree->model->input_count;
}
int kmp_tree_time_leaves(const kmp_tree *tree, kmp_ref *leaf, kmp_ref *direction);

/** Direction of derivatives by t at constant q and qd. NULL: no memory, and the graph has failed. */
struct kmp_derivative *kmp_partial_time_derivative(const kmp_tree *tree);

/** Direction of total time derivatives: q -> qd, t -> 1. NULL: no memory, and the graph has failed. */
struct kmp_derivative *kmp_time_derivative(const kmp_tree *tree);

/** The total time derivative of x(q, t), and that of a rate, with qd -> qdd. */
kmp_vec kmp_vec_rate(const kmp_tree *tree, kmp_vec x);
kmp_vec kmp_vec_acceleration(const kmp_tree *tree, kmp_vec rate);

/** v of a body's axes in the axes of its link, and the reverse. They differ where the joint's axis is oblique, the body
 * is attached by a point with axes, or it is welded. */
kmp_vec kmp_body_vector(const kmp_tree *tree, int body, kmp_vec v);
kmp_vec kmp_body_vector_back(const kmp_tree *tree, int body, kmp_vec v);

/** A rigid body on its link: mass, centre of mass from the link's origin, inertia about it, link axes. */
typedef struct kmp_inertia {
    kmp_ref mass;
    kmp_vec com;
    kmp_tensor about_com;
} kmp_inertia;
kmp_inertia kmp_body_inertia(const kmp_tree *tree, int body);

/** A number for each coordinate, equal for consecutive rotations about parallel axes; -1 for translations. */
void kmp_tree_runs(const kmp_tree *tree, int *run);

/** Nearest common ancestor of two links. */
int kmp_tree_common(const kmp_tree *tree, int i, int j);

/** True when link a is an ancestor of link i or i itself. */
bool kmp_tree_is_above(const kmp_tree *tree, int a, int i);

/** Link that a point of the model is fixed to. */
int kmp_point_link(const kmp_tree *tree, int point);

/** A point's position from the link's origin, link axes. */
kmp_vec kmp_point_local(const kmp_tree *tree, int point);

/** A vector of a link, and a position from the link's origin, in the axes of an ancestor link and from its origin. */
kmp_vec kmp_link_direction(const kmp_tree *tree, int link, kmp_vec v, int ancestor);
kmp_vec kmp_link_position(const kmp_tree *tree, int link, kmp_vec local, int ancestor);

/** A point's position from the origin of its ancestor link, in that link's axes. */
kmp_vec kmp_point_position(const kmp_tree *tree, int point, int ancestor);

/** A constant vector of a point's own axes, in the axes of an ancestor link. */
kmp_vec kmp_point_direction(const kmp_tree *tree, int point, const double v[3], int ancestor);

/** A point's three axes as vectors in the axes of an ancestor link. */
void kmp_point_axes(const kmp_tree *tree, int point, int ancestor, kmp_vec axes[3]);

/** From point a to point b in the axes of the nearest common ancestor, whose link is stored in *frame. */
kmp_vec kmp_point_difference(const kmp_tree *tree, int a, int b, int *frame);

/** Position, velocity or angular velocity of a point: from the origin of the ground, in its axes; `from` >= 0: from
 * that point, relative to its body, in its axes. */
kmp_vec kmp_point_measure(const kmp_tree *tree, kmp_measure_kind kind, int point, int from);

/** The rate of the distance of two points. */
kmp_ref kmp_point_approach(const kmp_tree *tree, int a, int b);

/** A measure of expressions, component `number` of it. */
kmp_ref kmp_tree_measure(const kmp_tree *tree, const kmp_measure *measure, int number);

/** The total time derivative of an expression of t and q. */
kmp_ref kmp_tree_rate(const kmp_tree *tree, const kmp_expr *of);
