/* SPDX-License-Identifier: BSD-3-Clause */
/* Common definitions of the reader's parts: the model under construction, errors, and the values that occur everywhere
 * in the language. Every kmp_read function reports errors itself, with place and names, and leaves its outputs
 * untouched when it has no result. The reader continues, so that all errors are reported at once. */
#pragma once

#include "base/file.h"
#include "model/data/force_table.h"
#include "model/data/model.h"
#include "model/files/yaml.h"
#include <kempe/settings.h>

/** A key of a mapping: a row of a table of src/model/keys. */
typedef struct kmp_key {
    const char *name, *unit, *absent; /* unit: "" none; absent: what holds without the key */
} kmp_key;

#define KMP_KEY(key, value, unit, absent, ...) {#key, unit, absent},

/** One inclusion of a file. */
typedef struct kmp_include_instance {
    int file, parent;            /* of the model's files: its own, and the including one */
    const char *prefix;          /* of all its names */
    const kmp_yaml *at, *offset; /* its ground: a body or a point, NULL the ground; the distance from it */
    const kmp_yaml *root;
    kmp_base base;   /* of a robot in another format */
    bool limits;     /* its limits of joints are stops */
    bool foreign;    /* it is in another format */
    bool leaves_out; /* parts of it by name */
    int ground;      /* the point that represents its ground, once bodies are read */
} kmp_include_instance;

typedef struct kmp_linkage kmp_linkage;

typedef struct kmp_reader {
    kempe_context *context;
    kempe_model *model;
    kmp_arena scratch; /* lives as long as the reading */
    const char *file;
    const kempe_setting *settings;
    int setting_count;
    kmp_include_instance *instances; /* included files, parents first */
    int instance_count;
    int scope; /* file whose names the current expression uses */
    int scope_line;
    const kmp_expr_locals *locals; /* names that the expressions being read have; NULL: none */
    const kmp_yaml *root;
    bool digests;                                   /* files are read, and go into a digest */
    kmp_digest digest;                              /* of all files and settings so far */
    kmp_linkage *linkage;                           /* NULL without joints between bodies */
    kmp_name_index bodies, points, motions, joints; /* of the model's; of bodies' joints */
    struct kmp_function_block *blocks; /* the entries of `states`, whose laws are read when they are needed */
    int first_algebraic;               /* of the model's variables: those before it are values of blocks */
    int first_contact_state;           /* of the states that contacts have, the last ones */
    int block_count, block_level;      /* level: blocks that are being read, each for the one before */
    bool wrong;                        /* an error was reported */
    bool *parameter_known;             /* its value is good; dependents of others are skipped without message */
    double *parameter_values;
    kmp_dimension *parameter_dimensions;
} kmp_reader;

/* -- mass (read_mass.c) ---------------------------------------------------------------------------- */

/** Warns of bodies that a coordinate turns about an axis whose moment of inertia is left out. */
void kmp_note_moments(kmp_reader *r);

/* -- files (files.c) ------------------------------------------------------------------------------- */

/** Appends a row to the model's files, whose label precedes line and column of messages; -1: no memory. */
int kmp_reader_add_file(kmp_reader *r, const char *label);

/** kmp_document_load for file `number` of the model. */
kempe_status kmp_reader_load(kmp_reader *r, int number, const char *text, size_t length, kmp_base base,
                             const kmp_yaml **root);

/** Adds a text that is read to the digest, with the ending of its file's name, which decides on its format. */
void kmp_reader_digest(kmp_reader *r, const char *path, const char *text, size_t length);

/** Logs a warning that the results of the model keep, too. */
void kmp_reader_warn(kmp_reader *r, kmp_place place, const char *format, ...) __attribute__((format(printf, 3, 4)));

/** Sorts the context's errors by place and drops repeated ones. */
kempe_status kmp_reader_sort_complaints(kmp_reader *r);

/** kempe_model_read_set within a computation that has begun. */
kempe_status kmp_model_read_file(kempe_context *context, const char *path, const kempe_setting *list, int count,
                                 kempe_model **model);

/* -- included files (read_include.c) ----------------------------------------------------------------- */

/* Keys of a model, of a body and of an include; other mappings have theirs beside their reader. */
extern const kmp_key kmp_model_keys[], kmp_body_keys[], kmp_include_keys[];

/** Checks the version of the format; false when the rest means something else in it. */
bool kmp_read_version(kmp_reader *r, const kmp_yaml *root, const char *what);

/** Merges the model's included files into r->root. */
void kmp_read_includes(kmp_reader *r);

/** NULL for the model's own file. */
const kmp_include_instance *kmp_reader_instance(const kmp_reader *r, int file);

/** A name in a file, as the model has it: with the file's prefix. */
const char *kmp_reader_name(kmp_reader *r, int file, const char *name);

/** A start value set at `again` after `before`: true where the file of `before` includes that of `again`, and takes
 * precedence. Otherwise it is given twice, which is an error. */
bool kmp_reader_said(kmp_reader *r, const char *what, const kmp_yaml *again, kmp_place before);

/** The model's name of a body; the ground of an included file is the body that it is put on. */
const char *kmp_reader_body_name(kmp_reader *r, int file, const char *name);

/* -- joints between bodies (read_linkage.c) ---------------------------------------------------------- */

/** Reads `joints` and chooses those that make the tree; the others become closures: r->linkage. */
void kmp_read_linkage(kmp_reader *r, const kmp_yaml *bodies);

/** The joint by which the k-th body (1: the first of the file) is attached, NULL after an error. */
const kmp_yaml *kmp_linkage_joint(const kmp_linkage *linkage, int body);

/** The cut joints as a mapping of closures, NULL without joints between bodies. */
const kmp_yaml *kmp_linkage_cuts(const kmp_reader *r);

/** Adds the coordinates of a cut joint, from the node that replaced it and its closure. */
void kmp_linkage_read_coordinates(kmp_reader *r, const kmp_yaml *made, const kmp_closure *closure);

/** For a node that represents a joint: its name, and its description in messages; NULL for every other node. */
const char *kmp_linkage_name(const kmp_reader *r, const kmp_yaml *made);
const char *kmp_linkage_what(kmp_reader *r, const kmp_yaml *made);

/** True if the second body of a joint carries the first. */
bool kmp_linkage_loads_parent(const kmp_reader *r, const kmp_yaml *made);

typedef enum kmp_linked { KMP_LINKED_NOT, KMP_LINKED_TREE, KMP_LINKED_CUT } kmp_linked;

/** Finds the joint of `JOINT` or `JOINT.k` among those between bodies: in the tree, or not (also when it is faulty). */
kmp_linked kmp_linkage_find(kmp_reader *r, const char *coordinate);

/** Words of expressions whose argument is a closure with its multipliers; NULL ends the list. */
extern const char *const kmp_words_of_loads[];

/** Reports keys of numbers that belong to another kind of joint than `row` (NULL: to any). */
void kmp_check_joint_keys(kmp_reader *r, const kmp_joint_row *row, const kmp_yaml *joint, const char *what);

/* -- errors -------------------------------------------------------------------------------------- */

/** Returns false: a function that has no result ends with `return kmp_reader_complain(..)`. */
bool kmp_reader_complain(kmp_reader *r, kmp_place place, const char *format, ...) __attribute__((format(printf, 3, 4)));

/** Reports "<sentence>; did you mean ...?" with the suggestion of `nearest`. */
void kmp_reader_complain_near(kmp_reader *r, kmp_place place, const kmp_nearest *nearest, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/** Text for the `what` of the functions below; "" when there is no memory. */
const char *kmp_reader_say(kmp_reader *r, const char *format, ...) __attribute__((format(printf, 2, 3)));

/** A text as such, which is freed. */
const char *kmp_reader_take(kmp_reader *r, kmp_text *text);

/** The names along a cycle, "b -> c -> b", from its first name in the list; `next` of one that is on it. `*first`: the
 * index of that name. */
const char *kmp_reader_cycle(kmp_reader *r, kmp_name_list names, int (*next)(const void *user, int k), const void *user,
                             int on, int *first);

/* -- nodes (reading.c) --------------------------------------------------------------------------- */

/** True when `node` is a mapping (nothing counts as an empty one); unknown keys are errors. `keys` ends with a row
 * without a name; NULL allows all. */
bool kmp_read_map(kmp_reader *r, const kmp_yaml *node, const char *what, const kmp_key *keys);

/** The dimension of a key's number, by its unit. */
kmp_dimension kmp_key_dimension(const kmp_key *keys, const char *name);

/** The numbers that hold without a key, in SI: "0.3", "14 mm", "`[3, 100]`"; false: the row has fewer than `count`. */
bool kmp_key_default(const kmp_key *keys, const char *name, int count, double *values);

/** True when `node` is a list, of `count` items when that is not negative. */
bool kmp_read_list(kmp_reader *r, const kmp_yaml *node, const char *what, int count);

/** The text of a scalar; NULL when it is none or empty. */
const char *kmp_read_word(kmp_reader *r, const kmp_yaml *node, const char *what);

/** Like kmp_read_word, for a new name: letters, digits and _, not beginning with a digit. */
const char *kmp_read_name(kmp_reader *r, const kmp_yaml *node, const char *what);

/** The value of a required key of `map`. */
const kmp_yaml *kmp_read_required(kmp_reader *r, const kmp_yaml *map, const char *what, const char *key);

/** The index of the one key of a list that `map` has; an error when it has none, or several. */
int kmp_read_one_key(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_name_list keys);

/** The number of keys of a list that `map` has; `*first`: the index of the first one. */
int kmp_count_keys(const kmp_yaml *map, kmp_name_list keys, int *first);
void kmp_complain_keys(kmp_reader *r, kmp_place place, const char *what, kmp_name_list keys, int count);

/** The index of a word among some; -1 after an error: "WHAT: the method is spline or linear, not 'x'", where `is` is
 * "the method is" and `last` is " or ". */
int kmp_read_choice(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_name_list words, const char *is,
                    const char *last);

/** The index of a name in a list of the model, as the node's file has it; -1 after an error: "WHAT: unknown KIND 'x'".
 */
int kmp_read_reference(kmp_reader *r, const kmp_yaml *node, const char *what, const char *kind, kmp_name_list names);

/** The entries of a section of the model, a mapping of names, one after the other. */
typedef struct kmp_section {
    kmp_reader *r;
    const char *kind; /* "force" */
    const kmp_yaml *map;
    int count, next;
    const kmp_yaml *key, *node; /* of the present entry */
    const char *name, *what;    /* in the model's arena; "force 'NAME'" */
} kmp_section;

kmp_section kmp_read_section(kmp_reader *r, const char *key, const char *kind);

/** Goes to the next entry and checks its name; false: there is none, or no memory. */
bool kmp_section_next(kmp_section *s);

/* -- values -------------------------------------------------------------------------------------- */

/** An expression of parameters, finite, of this dimension if its own is known. */
bool kmp_read_number(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted, kmp_number *number);
bool kmp_read_vector(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted, kmp_number vector[3]);

/** Three numbers: a list of them, or one for all. */
bool kmp_read_one_or_three(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted,
                           kmp_number numbers[3]);

/** A number outside the equations: its parameters cannot vary (kmp_reader_fix). */
bool kmp_read_fixed(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted, double *value);

/** A number outside the equations that is in a unit if it has none of its own: `si` of it are one in SI. */
bool kmp_read_quantity(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted, double si,
                       double *value);

/** Reports a number that is not positive or, for NOT_NEGATIVE, negative; `hint` ends the sentence. */
bool kmp_check_rule(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_field_rule rule, double value,
                    const char *hint);

/** Notes that something of the model depends on the parameters in an expression (NULL: on none). */
void kmp_reader_use(kmp_reader *r, const kmp_expr *expr);

/** Marks parameters in the expression of a number as fixed: they determine a setting of runs, or a value that shapes
 * the equations. */
void kmp_reader_fix_setting(kmp_reader *r, const kmp_number *number);
void kmp_reader_fix(kmp_reader *r, const kmp_number *number);

/** The expression of a parameter, over others; not valued, and without marking them as used. NULL after an error. */
const kmp_expr *kmp_read_constant(kmp_reader *r, const kmp_yaml *node, const char *what);
kmp_number kmp_number_of(const kmp_expr *expr, double value);

/** Reports a value that is not finite. */
bool kmp_check_finite(kmp_reader *r, const kmp_yaml *node, const char *what, double value);

/** Reports an expression whose dimensions do not fit each other, or whose own is known and not the required one. */
bool kmp_check_dimension(kmp_reader *r, const kmp_yaml *node, const char *what, const kmp_expr *expr,
                         kmp_dimension wanted, kmp_dimension *dimension);

/** Operands of an expression in addition to parameters. */
typedef enum kmp_operands {
    KMP_OF_PARAMETERS,
    KMP_OF_TIME,    /* t */
    KMP_OF_STATE,   /* t, q, qd */
    KMP_OF_LOADS,   /* and multipliers of the closures, which have been read */
    KMP_OF_MOTION,  /* and accelerations */
    KMP_COMPARISON, /* of two expressions of motion */
    KMP_OF_X,       /* t, x */
    KMP_OF_PLACE    /* t, x, y, z */
} kmp_operands;

/** NULL after an error. */
const kmp_expr *kmp_read_expr(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted,
                              kmp_operands allowed);

/** An expression of parameters and t; NULL after an error. `*first`: its value at t = 0. */
const kmp_expr *kmp_read_function(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted,
                                  double *first);

/** A point of the model, or an axis of it (-1: the point itself), for measures; false: no memory. */
bool kmp_reader_spot(kmp_reader *r, int point, int axis, kmp_measure_argument *spot);

/** The dimension of a coordinate, times s^power: that of its rate with -1. */
kmp_dimension kmp_motion_dimension(const kempe_model *model, int motion, double power);

/** The dimension of the effort on a motion: N m or N. */
kmp_dimension kmp_effort_dimension(const kempe_model *model, int motion);

/* -- names: an index, or -1 after an error --------------------------------------------------------- */

int kmp_read_body(kmp_reader *r, const kmp_yaml *node, const char *what);
int kmp_read_point(kmp_reader *r, const kmp_yaml *node, const char *what); /* BODY.POINT */
int kmp_read_point_text(kmp_reader *r, kmp_place place, const char *text, const char *what);
int kmp_read_point_of(kmp_reader *r, kmp_place place, int body, const char *name, const char *what); /* POINT */
bool kmp_read_two_points(kmp_reader *r, const kmp_yaml *node, const char *what, int point[2]);
int kmp_read_motion(kmp_reader *r, const kmp_yaml *node, const char *what); /* JOINT or JOINT.K */
int kmp_read_motion_text(kmp_reader *r, kmp_place place, const char *name, const char *what);

/* -- axes (read_axes.c) ------------------------------------------------------------------------------ */

/** A unit vector: x, -y, ..., or a list of three numbers. */
bool kmp_read_axis(kmp_reader *r, const kmp_yaml *node, const char *what, double axis[3]);

/** An orientation {x: axis, z: axis}: the first axis is used as given, the second is orthogonalised. From a single axis
 * the others follow (kmp_complete_axes). The columns of m are the three axes. */
bool kmp_read_axes(kmp_reader *r, const kmp_yaml *node, const char *what, double m[3][3]);

/** Right-handed axes whose k-th is `axis`, by the shortest rotation from unit vector k. For the axis opposite to k it
 * is half a turn about the one that follows k. */
void kmp_complete_axes(int k, const double axis[3], double m[3][3]);

/** The axes a, b and c of a joint's chain as columns of m: of an axis a, or, where b counts, of a list of two. */
void kmp_read_chain_axes(kmp_reader *r, const char *chain, const kmp_yaml *node, const char *what, double m[3][3]);

/** Right-handed axes whose k-th is `first` and whose l-th is in the plane with `second`; false when the two are
 * parallel. */
bool kmp_square_axes(int k, const double first[3], int l, const double second[3], double m[3][3]);

/* -- points of curves (read_points.c) ----------------------------------------------------------------- */

/** Points of a curve, and their places. */
typedef struct kmp_points {
    kmp_reader *r;
    const kmp_yaml *map; /* with both keys, lists of numbers, or with `csv` the names of columns */
    const char *what, *key[2];
    kmp_dimension dimension; /* of the numbers in lists */
    int count;
    double *x, *y; /* of the first key and of the second one; in scratch memory */
    kmp_place *place;
} kmp_points;

/** Reads the points; members up to `dimension` are set by the caller. False after an error. */
bool kmp_read_points(kmp_points *p);

/** Reads `unit`, of the columns of a CSV file: of this dimension, which an error calls so. Without it: SI. False after
 * an error. */
bool kmp_read_column_unit(const kmp_points *p, kmp_dimension dimension, const char *so, kmp_unit *unit);

/** Turns the order of the points round. */
void kmp_points_reverse(kmp_points *p);

/** The path of a file that another one names, beside that one. */
const char *kmp_path_beside(kmp_reader *r, int file, const char *name);

/** Reads a file for the reader, to be freed; NULL after an error: "WHAT: reason". */
char *kmp_read_file(kmp_reader *r, kmp_file_kind kind, const kmp_yaml *node, const char *what, const char *path,
                    size_t *length);

/** A table of the model by its name; NULL after an error. */
const kmp_named_table *kmp_read_table_name(kmp_reader *r, const kmp_yaml *node, const char *what);

/* -- shapes (shapes/read_shapes.c), after points ------------------------------------------------------ */

/** Of what a mapping has the key `shape`. */
typedef struct kmp_shape_owner {
    int body;
    const char *name;         /* in messages: "body 'arm'" */
    const kmp_number *origin; /* of a ground, whose places are from it; NULL: a body */
} kmp_shape_owner;

/** Appends the shapes that are without error to those of the model. */
void kmp_read_shapes(kmp_reader *r, const kmp_yaml *map, const kmp_shape_owner *owner);

/* -- sections that wings read ------------------------------------------------------------------------- */

/** The places of the reading where a wing (base/wings.h) may add to the model. Closures and forces that it adds have
 * room: one a wheel of the model. */
typedef enum kmp_reader_stage {
    KMP_READ_AFTER_TABLES,
    KMP_READ_AFTER_STATES,
    KMP_READ_AFTER_CLOSURES,
    KMP_READ_AFTER_FORCES
} kmp_reader_stage;

typedef struct kmp_reader_wing {
    const char *const *sections; /* of the model that it reads; NULL ends them */
    void (*read)(kmp_reader *r, kmp_reader_stage stage);
} kmp_reader_wing;

void kmp_read_wings(kmp_reader *r, kmp_reader_stage stage);

/* -- compliant contacts (compliant/) ------------------------------------------------------------------ */

/** Replaces joints with clearance by joints that move in a plane and entries of `contacts`, in r->root. */
void kmp_read_clearances(kmp_reader *r);

/** A contact with a law. */
void kmp_read_compliant(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_force *force);

/** True if such a mapping has a law that depends on the rate at the beginning of contact, and so a state. */
bool kmp_contact_keeps_rate(const kmp_yaml *map);

/* -- reactions that press surfaces together (read_reaction.c) ---------------------------------------- */

/** Adds locked translations to joints of the tree whose friction depends on their reaction: after the bodies; their
 * number; their locks, after the other closures. */
void kmp_read_pressed(kmp_reader *r);
int kmp_count_pressed(const kempe_model *model);
void kmp_lock_pressed(kmp_reader *r);

/** The size of the reaction that presses on a friction: of the closure that it names, or of its joint. NULL after an
 * error. */
const kmp_expr *kmp_read_reaction(kmp_reader *r, const kmp_force *force, const kmp_yaml *map, const char *what);

/* -- parts of the file, in this order -------------------------------------------------------------- */

void kmp_read_parameters(kmp_reader *r);
void kmp_read_inputs(kmp_reader *r);
void kmp_read_tables(kmp_reader *r);
/** True if expressions use a name already: a function, a parameter, a symbol. */
bool kmp_name_means_something(const kmp_reader *r, const char *name);
void kmp_read_bodies(kmp_reader *r);
void kmp_read_motions(kmp_reader *r, const kmp_yaml *const *joint_nodes); /* of bodies 1, 2, ... */
void kmp_read_mass(kmp_reader *r, const kmp_yaml *map, int body);         /* and shapes */
void kmp_read_states(kmp_reader *r); /* but for their rates, which are the last forces */
void kmp_add_state_rates(kmp_reader *r);

/** Reads the block whose value is variable `unknown` of the model, if it is one and has not been read. One that is
 * being read depends on itself, which is an error. */
void kmp_read_block_of(kmp_reader *r, int unknown);

/** The expression of a name. */
void kmp_reader_take_named(kmp_reader *r, kmp_place place, const char *what, const kmp_expr *value, kmp_unknowns *u);
void kmp_read_unknowns(kmp_reader *r); /* but for those that depend on multipliers */
void kmp_read_late_unknowns(kmp_reader *r);
void kmp_read_closures(kmp_reader *r); /* drives too */
void kmp_read_forces(kmp_reader *r);
void kmp_read_start(kmp_reader *r);
void kmp_read_goals(kmp_reader *r, const kmp_yaml *map); /* of the start, after the held coordinates */
void kmp_read_sensors(kmp_reader *r);
void kmp_read_run(kmp_reader *r);
void kmp_read_outputs(kmp_reader *r, const kmp_yaml *list);

/** The NAME of "word(NAME)"; NULL when `text` is not of that form. */
const char *kmp_read_argument(kmp_reader *r, const char *text, const char *word);

/** True if a setting names an input; its value is then read by kmp_read_inputs. */
bool kmp_is_input_setting(const kmp_reader *r, const char *name);

/** After all reading: warns of inputs that nothing uses. */
void kmp_settle_inputs(const kmp_reader *r);

/** After all reading: marks each parameter of the model as fixed or variable, used or unused, and warns of unused ones.
 */
void kmp_settle_parameters(kmp_reader *r);
