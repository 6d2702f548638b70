/* SPDX-License-Identifier: BSD-3-Clause */
/* Sets of equations by name, their entries and their operation counts; steps of a program: the longest chain of
 * named variables. */
#pragma once

#include "base/text.h"
#include "dynamics/equations.h"
#include "symbolic/program.h"

/** `serial`: variables, one assignment each; `vector`: their largest index, -1 without memory. */
typedef struct kmp_steps {
    long serial, vector;
} kmp_steps;

/** A variable is an output, or a value that is used more than once; a value used once is part of its user's assignment.
 * Inputs, numbers, functions only of parameters, and sines and cosines of sums of inputs have index 0 and are not
 * counted. */
kmp_steps kmp_program_steps(const kmp_program *p);

/* The rows of sets.def; several together are bits 1 << set. */
typedef enum kmp_eq_set {
#define KMP_EQUATIONS(id, name, derive, rows, columns, lower, entries, inputs, array, meaning) KMP_EQ_##id,
#define KMP_GROUP(name, sets)
#include "studies/show/sets.def"
#undef KMP_EQUATIONS
#undef KMP_GROUP
    KMP_EQ_SETS
} kmp_eq_set;

/** A row of sets.def. */
typedef struct kmp_set {
    const char *name;
    unsigned derive;   /* kmp_derivation_request.sets */
    int rows, columns; /* columns 0: a vector */
    bool lower;        /* only entries with k <= i */
    const kmp_ref *entries;
    unsigned inputs; /* in addition to t and q, bits 1 << kmp_input_kind */
    const char *array, *meaning;
} kmp_set;

/** One output and its name. */
typedef struct kmp_assignment {
    const char *set; /* "M", "C" ... */
    int row, col;    /* from 0; -1: no such index */
    kmp_ref value;
} kmp_assignment;

/** A set with its entries in these equations; NULL: only its description. */
kmp_set kmp_set_of(const kmp_equations *eq, int set);
int kmp_set_size(const kmp_set *set);

/** The sets of a name, which names a set or a group; 0: none. `length` of its characters count. */
unsigned kmp_sets_find(const char *name, size_t length);

/** All names, groups first, with commas between. */
void kmp_sets_list(kmp_text *text);

/** The equations to derive for the sets: kmp_derivation_request.sets. */
unsigned kmp_sets_derive(unsigned sets);

/** The number of entries (of M entries with k <= i), and the entries set by set. */
int kmp_sets_size(const kmp_equations *eq, unsigned sets);
void kmp_sets_put(const kmp_equations *eq, unsigned sets, kmp_assignment *entries);

/** The values of the entries, to be freed; NULL: no memory. */
kmp_ref *kmp_sets_outputs(const kmp_equations *eq, unsigned sets);

/** The entries as outputs of one program with one stage after the stage of the parameters. NULL: no memory. */
kmp_program *kmp_sets_program(const kmp_equations *eq, unsigned sets);

typedef struct kmp_tally {
    kmp_counts counts, runtime; /* runtime: without the operations that are done once for the parameters */
    long created, kept;         /* nodes of the graph; of the program: constants, inputs and instructions */
    long operations, useless;   /* instructions; nodes that would be ones and that no entry needs */
    kmp_steps steps;
} kmp_tally;

/** Counts some stages of a program; `useless` and `steps` are not set. */
kmp_tally kmp_tally_program(const kmp_program *program, int first_stage, int last_stage);

/** Derives only these sets, otherwise as `scene` requires, and counts the operations of one program. */
kempe_status kmp_tally_sets(const kempe_model *model, const kmp_derivation_request *scene, unsigned sets,
                            kmp_tally *tally);

/** One assignment per line, zero outputs left out; the auxiliary variables of a set precede it. False: no memory. */
bool kmp_assignments_print(const kmp_equations *eq, int count, const kmp_assignment *assignments, kmp_text *text);
