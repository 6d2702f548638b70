/* SPDX-License-Identifier: BSD-3-Clause */
/* Common definitions of the reader's parts: the model under construction, errors, and the values that occur everywhere
 * in the language. Every kmp_read function reports errors itself, with place and names, and leaves its outputs
 * untouched when it has no result. The reader continues, so that all errors are reported at once. */
#pragma once

#include "base/arena.h"
#include "base/cache/digest.h"
#include "base/context.h"
#include "base/file.h"
#include "base/text.h"
#include "model/data/force_table.h"
#include "model/data/place.h"
#include "model/files/yaml.h"
#include "model/language/dimension.h"
#include "model/language/expression.h"
#include "model/language/nearest.h"
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <stdbool.h>

/** A key of a mapping: a row of a table of src/model/keys. */
typedef struct kmp_key {
    const char *name, *unit, *absent; /* unit: "" none; absent: what holds without the key */
} kmp_key;

#define KMP_KEY(key, value, unit, absent, ...) {#key, unit, absent},

/** One inclusion of a file. */
typedef struct kmp_include_instance {
    int file, parent;              /* of the model's files: its own, and the including one */
    const char *prefix;            /* of all its names */
    const kmp_yaml *at, *offset;   /* its ground: a body or a point, NULL the ground; the distance from it */
    const kmp_yaml *root, *source; /* as it is merged; as it was read, before ports are bound */
    const kmp_yaml *ports;         /* that it declares, names and kinds; NULL: none */
    const kmp_yaml **bound;        /* what they are bound to, in their order */
    kmp_base base;                 /* of a robot in another format */
    bool limits;                   /* its limits of joints are stops */
    bool foreign;                  /* it is in another format */
    bool leaves_out;               /* parts of it by name */
    int ground;                    /* the point that represents its ground, once bodies are read */
} kmp_include_instance;

typedef struct kmp_linkage kmp_linkage;

/** An angle without a unit of more than a turn. */
typedef struct kmp_turns {
    kmp_place place;
    const char *what;
    double value;
    bool certain; /* it is rather in degrees in any model */
} kmp_turns;

/** A moment of inertia, or a component of a centre of mass, without a unit. */
typedef struct kmp_bare_size {
    kmp_place place;
    const char *what;
    int body;
    bool moment;
    double value;
} kmp_bare_size;

typedef struct kmp_reader {
    kempe_context *context;
    kempe_model *model;
    kmp_arena scratch; /* lives as long as the reading */
    const char *file;
    const kempe_setting *settings;
    int setting_count;
    const char *bodies_as;           /* the model that flexible bodies have (body_models.h); NULL: their own */
    kmp_include_instance *instances; /* included files, parents first */
    int instance_count;
    const kmp_yaml **set_values; /* by which including files have set parameters and inputs */
    int set_count;
    const kmp_yaml **decisive; /* numbers that decide which parts there are (part_counts.h) */
    int decisive_count;
    int scope; /* file whose names the current expression uses */
    int scope_line;
    const kmp_expr_locals *locals; /* names that the expressions being read have; NULL: none */
    const kmp_yaml *root;
    bool foreign;                                   /* the file of the model is in another format */
    bool digests;                                   /* files are read, and go into a digest */
    kmp_digest digest;                              /* of all files and settings so far */
    kmp_linkage *linkage;                           /* NULL without joints between bodies */
    kmp_name_index bodies, points, motions, joints; /* of the model's; of bodies' joints */
    kmp_name_index forces, closures;
    struct kmp_segmented *segmented; /* beams in segments (segments.h) */
    int segmented_count;
    struct kmp_flexible_reading *flexibles; /* of the flexible bodies of the model */
    struct kmp_function_block *blocks;      /* the entries of `states`, whose laws are read when they are needed */
    int first_algebraic;                    /* of the model's variables: those before it are values of blocks */
    int first_element_state;                /* of the states of wings and contacts, the last ones, without rates here */
    int block_count, block_level;           /* level: blocks that are being read, each for the one before */
    const struct kmp_outline_pair *pair;    /* of the contact being read; NULL: it has no outline */
    bool wrong;                             /* an error was reported */
    bool unread;           /* a section, body, joint or included file was not read: names may be missing */
    bool *parameter_known; /* its value is good; dependents of others are skipped without message */
    double *parameter_values;
    kmp_dimension *parameter_dimensions;
    kmp_turns *turns;
    int turn_count;
    kmp_bare_size *sizes;
    int size_count;
} kmp_reader;

/* -- joints between bodies (read_linkage.c) ---------------------------------------------------------- */

typedef enum kmp_linked { KMP_LINKED_NOT, KMP_LINKED_TREE, KMP_LINKED_CUT } kmp_linked;

/* -- errors -------------------------------------------------------------------------------------- */

/** Returns false: a function that has no result ends with `return kmp_reader_complain(..)`. */
bool kmp_reader_complain(kmp_reader *r, kmp_place place, const char *format, ...) __attribute__((format(printf, 3, 4)));

/** The same of a node, about what is read: "WHAT: <sentence>". The macro takes both of an object with `r` and `what`.
 */
bool kmp_complain_of(kmp_reader *r, const kmp_yaml *at, const char *what, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
#define KMP_COMPLAIN(of, at, ...) kmp_complain_of((of)->r, (at), (of)->what, __VA_ARGS__)

/** Reports "<sentence>; did you mean ...?" with the suggestion of `nearest`. */
void kmp_reader_complain_near(kmp_reader *r, kmp_place place, const kmp_nearest *nearest, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/** The same as kmp_reader_complain_near, of a name that the model does not have: nothing where parts that may define it
 * were not read, which was reported. */
void kmp_reader_complain_unknown(kmp_reader *r, kmp_place place, const kmp_nearest *nearest, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

/** Text for the `what` of the functions below; "" when there is no memory. */
const char *kmp_reader_say(kmp_reader *r, const char *format, ...) __attribute__((format(printf, 2, 3)));

/** A text without further structure, which is freed. */
const char *kmp_reader_take(kmp_reader *r, kmp_text *text);

/** The names along a cycle, "b -> c -> b", from its first name in the list; `next` of one that is on it. `*first`: the
 * index of that name. */
const char *kmp_reader_cycle(kmp_reader *r, kmp_name_list names, int (*next)(const void *user, int k), const void *user,
                             int on, int *first);

/* -- nodes (reading.c) --------------------------------------------------------------------------- */

/** True when `node` is a mapping (nothing counts as an empty one); unknown keys are errors. `keys` ends with a row
 * without a name; NULL allows all. */
bool kmp_read_map(kmp_reader *r, const kmp_yaml *node, const char *what, const kmp_key *keys);

/** Their names. */
kmp_name_list kmp_key_names(const kmp_key *keys);

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

/** True for a scalar that is this word; NULL is none. */
bool kmp_is_word(const kmp_yaml *node, const char *word);

/** The index of a word among some; -1 after an error: "WHAT: the method is spline or linear, not 'x'", where `is` is
 * "the method is". Of a key that a mapping may lack: `absent` without it. */
int kmp_read_choice(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_name_list words, const char *is);
int kmp_read_choice_of(kmp_reader *r, const kmp_yaml *map, const char *key, const char *what, kmp_name_list words,
                       const char *is, int absent);

/** The same of a key that must be a word; `*found` is unchanged without it, and after an error: false. */
bool kmp_read_word_of(kmp_reader *r, const kmp_yaml *map, const char *what, const char *key, kmp_name_list words,
                      int *found);
extern const kmp_name_list kmp_yes, kmp_no_or_yes, kmp_axis_letters; /* yes; no, yes; x, y, z */

/** An entry of the model that adds entries to other sections before these are read: "rope", its key, the document. */
typedef struct kmp_entry_owner {
    kmp_reader *r;
    const char *kind;
    const kmp_yaml *key;
    kmp_yaml *root;
} kmp_entry_owner;

/** Adds such an entry; an error where the section has its name already. `part`: what it is of the owner. A section that
 * is not a mapping is reported where it is read. */
void kmp_add_own_entry(const kmp_entry_owner *owner, const char *part, const char *section, const char *name,
                       kmp_place place, const kmp_yaml *entry);

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

/** Operands of an expression in addition to parameters. */
typedef enum kmp_operands {
    KMP_OF_PARAMETERS,
    KMP_OF_TIME,    /* t */
    KMP_OF_STATE,   /* t, q, qd */
    KMP_OF_NEXT,    /* the same, at separate times */
    KMP_OF_LOADS,   /* and multipliers of the closures, which have been read */
    KMP_OF_MOTION,  /* and accelerations */
    KMP_COMPARISON, /* of two expressions of motion */
    KMP_OF_X,       /* t, x */
    KMP_OF_PLACE    /* t, x, y, z */
} kmp_operands;

/* -- points of curves (read_tables.c) ----------------------------------------------------------------- */

/** Points of a curve, and their places. */
typedef struct kmp_points {
    kmp_reader *r;
    const kmp_yaml *map; /* with both keys, lists of numbers, or with `csv` the names of columns */
    const char *what, *key[2];
    kmp_dimension dimension; /* of the numbers in lists */
    int count;
    double *x, *y; /* of the first key and of the second one; in scratch memory */
    kmp_place *place;
    bool has_unit[2]; /* the columns have units in their file, and the numbers are in SI */
    kmp_unit unit[2]; /* the units of the columns; without one its dimension fits any */
} kmp_points;

/* -- shapes (read_mass.c), after points ------------------------------------------------------ */

/** Of what a mapping has the key `shape`. */
typedef struct kmp_shape_owner {
    int body;
    const char *name;         /* in messages: "body 'arm'" */
    const kmp_number *origin; /* of a ground, whose places are from it; NULL: a body */
} kmp_shape_owner;

/* -- sections that wings read ------------------------------------------------------------------------- */

/** The places of the reading where a wing (base/wings.h) may add to the model. Closures and forces that it adds have
 * room: one a wheel and a tyre of the model. */
typedef enum kmp_reader_stage {
    KMP_READ_AFTER_TABLES,
    KMP_READ_WITH_STATES, /* states that elements of a wing have: kmp_reader_add_state */
    KMP_READ_AFTER_STATES,
    KMP_READ_AFTER_CLOSURES,
    KMP_READ_AFTER_FORCES
} kmp_reader_stage;

typedef struct kmp_reader_wing {
    const char *const *sections; /* of the model that it reads; NULL ends them */
    void (*read)(kmp_reader *r, kmp_reader_stage stage);
} kmp_reader_wing;
