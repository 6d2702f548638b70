/* SPDX-License-Identifier: BSD-3-Clause */
/* A program: the nodes of a graph that the requested outputs need, as flat straight-line code in stages.
 *
 * Stage 0 holds instructions that depend on parameters only and runs once; stage s > 0 computes the needs of output
 * group s that no earlier stage has. Operands are value << 1 | sign; values are numbered constants first, then inputs,
 * then instructions. Instructions keep the order of generation. */
#pragma once

#include "base/text.h"
#include "symbolic/graph.h"
#include "symbolic/label.h"
#include <kempe/kempe.h>

typedef struct kmp_instruction {
    uint8_t op;
    uint32_t a, b, c; /* operands; parameters of the object applied to a: b, c */
} kmp_instruction;

/** Operand number k. */
static inline uint32_t kmp_instruction_operand(const kmp_instruction *in, int k)
{
    return k == 0 ? in->a : k == 1 ? in->b : in->c;
}

typedef struct kmp_program_input {
    kmp_input_kind kind;
    uint32_t index;
} kmp_program_input;

/** Operations of one stage or of a whole program. `paper`: + - * / as Fisette and Samin count. `robotran`: + - * /,
 * unary minus (the sign of an output is free, products and sums have none), and one for each sine, cosine or other
 * function.
 */
typedef struct kmp_counts {
    long add, mul, div, neg, trig, other;
    long paper, robotran;
} kmp_counts;

/** An implicit block. Stage 1 of its program gives the first guess of the unknowns q from the arguments p. The last
 * stage gives residuals and their derivatives with respect to the unknowns, row by row. With candidates of unknown 0 a
 * stage between them computes the merit by which the first guess is chosen, and guesses may depend on q[0]. With one
 * unknown the last stage gives the merit's derivative too. A block of averages solves nothing (implicit.h). Stage 1 of
 * its program is the exponent at the place q[0] and the exponent that is needed, stage 2 the averaged expressions
 * there, and candidates are the places. */
typedef struct kmp_program_block {
    int unknowns, arguments;
    bool linear;       /* the equations are linear in the unknowns */
    bool averages;     /* unknown 0 is the logarithm of the sum, the others are averages */
    int candidates;    /* 0: the guess is the only one */
    double *candidate; /* increasing */
    struct kmp_program *program;
} kmp_program_block;

typedef struct kmp_program {
    kmp_arena arena;  /* of all arrays except the arrays of tables and blocks */
    int stages;       /* stage 0 included */
    int *code;        /* stages + 1: first instruction of each stage, and the end */
    int *outputs;     /* stages + 1: first output of each stage, and the end */
    uint32_t *output; /* operands */
    kmp_instruction *instruction;
    double *constant;
    kmp_program_input *input;
    int constant_count, input_count;
    struct kmp_table **table; /* the tables in use */
    int table_count;
    kmp_program_block *block; /* the blocks in use, copied */
    int block_count;
    kmp_label *label;                  /* by instruction; NULL where the graph kept none */
    uint8_t *contraction;              /* by instruction (contraction.h); NULL: each one is rounded */
    uint32_t graph_nodes;              /* before useless ones were left out */
    struct kmp_program_shared *shared; /* program_forms.h */
} kmp_program;

/** A program with one group of outputs per stage, from stage 1 on; addition theorems are applied to all together. NULL:
 * no memory. */
kmp_program *kmp_program_new(kmp_graph *g, int groups, const int *count, const kmp_ref *const *outputs);
/** The same of one stage, in which charts of joints are inputs as all others: generated code prepares only parameters.
 */
kmp_program *kmp_program_of_parameters(kmp_graph *g, int count, const kmp_ref *outputs);
void kmp_program_free(kmp_program *p);

/** Small angles by which sines and cosines are turned: room for as many as the program has instructions. */
typedef struct kmp_angle_updates {
    kmp_ref *angle;
    int count;
} kmp_angle_updates;

typedef struct kmp_importing {
    int stages;               /* of the program; 0: all */
    int count;                /* replaced inputs */
    const kmp_ref *input;     /* count: kmp_input */
    const kmp_ref *by;        /* what takes their place */
    const kmp_ref *at;        /* the same at a place nearby; NULL: there is none */
    kmp_angle_updates *turns; /* with `at`: sines and cosines are taken at `at`, turned by these angles d; the error of
                               * a value is |d|^5 / 120 */
} kmp_importing;

/** The program's outputs as references in a graph; its implicit blocks there are only for evaluation. False: no
 * memory.
 */
bool kmp_program_import(const kmp_program *p, kmp_graph *g, const kmp_importing *how, kmp_ref *outputs);

/** An empty program with room in all arrays for these numbers of stages, instructions, outputs, constants and inputs.
 * NULL: no memory. */
kmp_program *kmp_program_with_room(size_t stages, size_t code, size_t outputs, size_t constants, size_t inputs);

/** Number of the table in the program, which owns it too; -1: no memory. */
int kmp_program_add_table(kmp_program *p, struct kmp_table *table);

/** Counts of the instructions of some stages. Implicit blocks count as one function each: kmp_solving_count. */
kmp_counts kmp_program_count(const kmp_program *p, int first_stage, int last_stage);
/** Adds one instruction, or other counts, this number of times. */
void kmp_counts_take(kmp_counts *counts, const kmp_instruction *instruction, long times);
void kmp_counts_add(kmp_counts *counts, const kmp_counts *more, long times);

/** The highest derivative of a given function of time that the program reads, 0 to 2; -1: it reads none. */
int kmp_program_time_order(const kmp_program *p, int function);

/** The number of values: constants, inputs, instructions. */
static inline int kmp_program_values(const kmp_program *p)
{
    return p->constant_count + p->input_count + p->code[p->stages];
}
/** For each value, in depends and bent (kmp_program_values): bit b where it may depend on the input of a kind with
 * index first + b, and where it may be nonlinear in it. */
void kmp_program_dependences(const kmp_program *p, kmp_input_kind kind, uint32_t first, uint64_t *depends,
                             uint64_t *bent);

/** An independent copy. NULL: no memory. */
kmp_program *kmp_program_copy(const kmp_program *p);
/** The program of only the first stages, as many as given, with what they need. NULL: no memory. */
kmp_program *kmp_program_first(const kmp_program *p, int stages);
/** A program without the instructions that are `given`, as far as the others need them: number list[k] of these is the
 * input KMP_IN_Q[first + k]. `given` and `list` have an entry for each instruction. NULL: no memory. */
kmp_program *kmp_program_given(const kmp_program *p, const bool *given, int first, int *list, int *count);
/** True if inputs, code, tables and outputs are equal, to the bit; false where there are blocks. */
bool kmp_program_equal(const kmp_program *a, const kmp_program *b);
/** Number of a copy of the block in the program; -1: no memory. */
int kmp_program_add_block(kmp_program *p, const kmp_program_block *block);

/** Value of instruction i (of no implicit block) from the values of its operands (signs included); every back end uses
 * it, except for sums that take a product (contraction.h). */
double kmp_program_value(const kmp_program *p, int i, double x, double y, double z);

/** The program as text, one instruction per line (docs/program_format.md); `stage_name` (stages entries) may be NULL.
 */
void kmp_program_print(const kmp_program *p, const char *const *stage_name, kmp_text *text);
