/* SPDX-License-Identifier: BSD-3-Clause */
/* Expressions of the model language as trees: parsed once, evaluated as numbers (parameters only) or built
 * into a graph by src/dynamics. Grammar: docs/model/expressions.md. */
#pragma once

#include "base/arena.h"
#include "base/context.h"
#include "base/text.h"
#include "model/language/dimension.h"
#include "model/language/nearest.h"

struct kmp_table;
struct kmp_surface;
struct kmp_parser;

typedef enum kmp_expr_kind {
    KMP_EXPR_NUMBER,    /* value */
    KMP_EXPR_PARAMETER, /* index of the parameter */
    KMP_EXPR_TIME,      /* t */
    KMP_EXPR_INPUT,     /* index of the input; value: at t = 0 */
    KMP_EXPR_Q,         /* index of the coordinate: q(NAME) */
    KMP_EXPR_QD,        /* index of the coordinate: qd(NAME); of the motion of a state: its value */
    KMP_EXPR_LAMBDA,    /* index of the closure, number among its multipliers: lambda(LOOP), lambda(LOOP.k); number -k:
                         * the size of the force of k closures from it on; with a measure: component `number` of it */
    KMP_EXPR_NEG,       /* a */
    KMP_EXPR_ADD,       /* a, b */
    KMP_EXPR_SUB,
    KMP_EXPR_MUL,
    KMP_EXPR_DIV,
    KMP_EXPR_POW,      /* a ^ b; b must be a number or an expression of parameters */
    KMP_EXPR_CALL,     /* function, a [, b [, c]] */
    KMP_EXPR_LESS,     /* a < b: 1 or 0; comparisons are first arguments of `if` */
    KMP_EXPR_AT_MOST,  /* a <= b */
    KMP_EXPR_GREATER,  /* a > b */
    KMP_EXPR_AT_LEAST, /* a >= b */
    KMP_EXPR_TABLE,    /* table(a) or table(a, b) */
    KMP_EXPR_UNKNOWN,  /* index of the group of algebraic variables, number in it; a: the operands of its value */
    KMP_EXPR_PLACE,    /* x, y, z: index 0, 1, 2 of a place, given at evaluation */
    KMP_EXPR_MEASURE,  /* measure, number of its component */
    KMP_EXPR_RATE,     /* the derivative of a by t along the motion */
    KMP_EXPR_CUT,      /* a, the coordinate of a cut joint as a function of the others; measure: as it is written */
    KMP_EXPR_SIDES     /* levels of friction: a while its rate is positive, b while it is negative; an infinite number:
                        * without limit. One of them is evaluated at a time */
} kmp_expr_kind;

/* Functions of the language, one row each. */
typedef enum kmp_function {
#define KMP_FUNCTION(name, arity, value, node) KMP_FUNCTION_##name,
#include "model/language/functions.def"
#undef KMP_FUNCTION
    KMP_FUNCTION_COUNT
} kmp_function;

/* Quantities of points and axes, one row each. */
typedef enum kmp_measure_kind {
#define KMP_MEASURE(kind, ...) KMP_MEASURE_##kind,
#include "model/language/measures.def"
#undef KMP_MEASURE
    KMP_MEASURE_KINDS
} kmp_measure_kind;

/** The number of the size of a vector, after its components x, y and z. */
enum { KMP_MEASURE_SIZE = 3 };

/** A point of the model, or one of its axes; a contact, a closure or a joint. */
typedef struct kmp_measure_argument {
    int point;   /* -1: none */
    int axis;    /* 0, 1, 2; -1: the point itself */
    int frame;   /* of a point: 1 + the body in whose axes it rests; 0: it moves with a deformation */
    int closure; /* of a reaction or moment; the body that a joint of the tree carries; a pair of bearings; a rope */
    int place;   /* of a sheave: of the path of its rope, from 0; of a rope: its closure, -1 or -2 */
    const double *along; /* in place of axis 0, 1, 2: a unit vector in the point's axes; NULL: none */
    const char *name;    /* BODY.POINT, a contact, a closure or a joint, as the model has it */
} kmp_measure_argument;

typedef struct kmp_measure {
    kmp_measure_kind kind;
    const char *word;
    int components; /* as in measures.def */
    int count;
    kmp_measure_argument argument[3];
} kmp_measure;

/** Continuation of a table beyond its points: straight on, which is a doubt unless the model requests it; the value at
 * the end; the end of the run. */
typedef enum kmp_outside { KMP_OUTSIDE_NOT_SAID, KMP_OUTSIDE_LINEAR, KMP_OUTSIDE_HOLD, KMP_OUTSIDE_ERROR } kmp_outside;

/** A function of one or two variables given by points, under the name that expressions use. */
typedef struct kmp_named_table {
    const char *name;
    bool of_two;             /* of two variables: a surface, otherwise a table */
    struct kmp_table *table; /* NULL while something is wrong with it */
    struct kmp_surface *surface;
    bool periodic; /* of one variable: it is continued with the period of its range */
    double rise;   /* by which it grows each period */
    kmp_outside outside;
} kmp_named_table;

typedef struct kmp_expr {
    kmp_expr_kind kind;
    kmp_function function;
    int index, number; /* number: from 0 */
    double value;
    kmp_dimension unit; /* of a number, of an input */
    const kmp_named_table *table;
    const struct kmp_unknowns *unknowns;
    const kmp_measure *measure;
    int symbol; /* of a constant law, as in kmp_number */
    int column; /* its column; of an operation, its sign's column */
    const struct kmp_expr *a, *b, *c;
} kmp_expr;

/** A number of the model: its value with the model's parameters, and the expression it came from (NULL for
 *  a plain literal). */
typedef struct kmp_number {
    double value;
    const kmp_expr *expr;
    int symbol; /* its number where numbers are kept as symbols: 1, 2, ... in the order of reading; 0: none */
} kmp_number;

/** Algebraic variables, which are solved wherever they are needed, or an expression under a name. */
enum { KMP_UNKNOWNS_MOST = 6 };

/** The extent of an expression with its names, or parameters, written out: `level` names one in the other, `size`
 * operations and operands. Functions that call themselves for each name have these as their depth and their work. */
typedef struct kmp_extent {
    int level;
    double size;
} kmp_extent;

enum { KMP_MOST_NAME_LEVELS = 200, KMP_MOST_WRITTEN_OUT = 1000000 };

typedef struct kmp_unknowns {
    const char *name;
    kmp_extent extent;
    int count;  /* 0: an expression under a name */
    bool late;  /* depends on multipliers: read after the closures */
    bool block; /* the value of a function block: its kinks are located where a force uses it */
    const char *unknown[KMP_UNKNOWNS_MOST];
    kmp_number guess[KMP_UNKNOWNS_MOST];
    const kmp_expr *zero[KMP_UNKNOWNS_MOST]; /* one per variable; a named expression is the first; NULL: not read */
    const kmp_expr *leaves;                  /* all that occurs in them but operations, added up; NULL: nothing yet */
} kmp_unknowns;

/** The names that expressions use: of the variables, or of the expression. */
static inline kmp_name_list kmp_unknown_names(const kmp_unknowns *unknowns)
{
    return unknowns->count > 0 ? KMP_NAMES(unknowns->unknown, unknowns->count) : KMP_NAMES(&unknowns->name, 1);
}

/** Kinds of names in expressions. */
typedef enum kmp_expr_symbol { KMP_SYMBOL_PARAMETER, KMP_SYMBOL_COORDINATE, KMP_SYMBOL_CLOSURE } kmp_expr_symbol;

/** A name with a meaning in one place of the model: "distance" in the law of a force along a line. */
typedef struct kmp_expr_local {
    const char *name;
    const struct kmp_expr *expr;
    bool yields; /* to the same name of a parameter, input or variable, which is an error otherwise */
} kmp_expr_local;

enum { KMP_LOCALS_MOST = 24 };

typedef struct kmp_expr_locals {
    int count;
    kmp_expr_local local[KMP_LOCALS_MOST];
} kmp_expr_locals;

/** The place of an expression in its file, and the resolution of its symbols. A NULL resolver, or -1 from one, means
 * that such a symbol is not known here. `suggest`, if not NULL, ends the error message (with the nearest known name).
 */
typedef struct kmp_expr_scope {
    kempe_context *context;
    kmp_arena *arena;
    const char *file;
    int line, column; /* of the expression's first character */
    void *user;
    int (*parameter)(void *user, const char *name);
    int (*coordinate)(void *user, const char *name);
    const kmp_expr *(*cut)(void *user, const char *name); /* the coordinate of a cut joint; NULL: there is none */
    int (*closure)(void *user, const char *name);         /* closures whose multipliers are allowed */
    /* The body that a joint of the tree carries, -1: there is none. *name becomes its name in the model, *obstacle why
     * its load is not known, or NULL. */
    int (*joint)(void *user, const char **name, const char **obstacle);
    /* Sets index, unit and value of an input; false: there is none. */
    bool (*input)(void *user, const char *name, struct kmp_expr *input);
    int (*state)(void *user, const char *name);                    /* the motion of a state */
    const kmp_named_table *(*table)(void *user, const char *name); /* NULL: there is none */
    /* The unknowns that a name is one of: their index, and which; -1: there are none. */
    int (*unknown)(void *user, const char *name, const struct kmp_unknowns **unknowns, int *number);
    /* Sets the point and its name from the text BODY.POINT at a column; false: there is none, which is reported with
     * `word` as its beginning. NULL: points and rates are not allowed. */
    bool (*point)(void *user, const char *text, const char *word, int column, kmp_measure_argument *argument);
    /* The closure of a pair of gears, and its name in the model; -1: there is none. NULL: none are known. */
    int (*gear)(void *user, const char **name);
    /* A rope, and its name in the model; -1: there is none. *places: of its path. *closure: its multiplier is the
     * tension; -1: it is not known yet, -2: the rope is elastic. NULL: none are known. */
    int (*rope)(void *user, const char **name, int *places, int *closure);
    bool accelerations;                                   /* accelerations of points are allowed */
    bool jumps;                                           /* floor and wrap are allowed, whose jumps no event locates */
    const char *(*contact)(void *user, const char *name); /* a contact's name in the model; NULL: there is none */
    /* Two bearings: their number, -1: there are none. *name becomes their name in the model. */
    int (*bearing)(void *user, const char **name);
    const kmp_expr_locals *locals; /* NULL: none */
    void (*suggest)(void *user, const char *name, kmp_expr_symbol symbol, kmp_text *sentence);
    bool incomplete; /* parts of the model were not read: an unknown name has no sentence */
    bool time;       /* t is allowed */
    bool compares;   /* a comparison is required: a < b */
    int place;       /* this number of x, y, z means a place, even if parameters have these names */
    bool *degrees;   /* becomes true where a number is in deg; NULL: of no interest */
    /* Called with a number without a unit in sin, cos or tan that is more than a turn; NULL: of no interest. */
    void (*turns)(void *user, const char *function, double value, int column);
} kmp_expr_scope;

/** Names of an expression's symbols. */
typedef struct kmp_expr_names {
    kmp_name_list parameters, coordinates, closures, inputs;
    int states; /* the last ones of `coordinates`, named separately */
} kmp_expr_names;

/** NULL after an error (with the column inside the expression), or when the arena has no memory. */
const kmp_expr *kmp_expr_parse(const kmp_expr_scope *scope, const char *text);

/** An error in the dimensions of an expression: the node at which they do not fit, and two that differ. */
typedef struct kmp_expr_fault {
    const kmp_expr *at; /* NULL: nothing is wrong */
    kmp_dimension a, b;
} kmp_expr_fault;

/** The first node for which `is` is true, each before its operands; NULL when there is none. */
typedef bool (*kmp_expr_test)(const kmp_expr *expr, const void *user);

/** Dependence of a function on its argument, in a unit over which it is smooth. */
typedef enum kmp_argument_kind {
    KMP_ARGUMENT_PEAK, /* as its exponential */
    KMP_ARGUMENT_STEP, /* it changes by all that it can over some units */
    KMP_ARGUMENT_WAVE, /* it may change anywhere, as a sine or a table */
    KMP_ARGUMENT_SIZE, /* abs: it has a kink at zero */
    KMP_ARGUMENT_KINK  /* it has a kink or a jump at zero */
} kmp_argument_kind;

/** A function within an expression, by its argument. */
typedef struct kmp_expr_argument {
    kmp_argument_kind kind;
    const kmp_expr *of, *in; /* the argument, made in the arena or a part of the expression; its function */
    const struct kmp_expr_argument *next;
} kmp_expr_argument;

/** Skips space, and the character c if it follows; false: it does not. */
void kmp_parse_skip_space(struct kmp_parser *p);
bool kmp_parse_take(struct kmp_parser *p, char c);

/** The length of the word at s, 0 when there is none. */
size_t kmp_parse_word_length(const char *s);

/** The same of a name of the model, which may be `port.NAME`. */
size_t kmp_parse_name_length(const char *s);

/** A copy of the n characters at p->at, which are passed. */
const char *kmp_parse_copy(struct kmp_parser *p, size_t n);

/** The column of a place in the text. */
int kmp_parse_column(const struct kmp_parser *p, const char *where);

/** Errors at a place: any sentence; the grammar requires `wanted` at p->at; a name is unknown. */
const kmp_expr *kmp_parse_complain(const struct kmp_parser *p, const char *where, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
const kmp_expr *kmp_parse_wanted(struct kmp_parser *p, const char *wanted);

/** Appended to an error at a comma between digits. */
#define KMP_DECIMAL_POINT "; a number has a decimal point, as 2.5, and no comma"
const kmp_expr *kmp_parse_unknown_name(const struct kmp_parser *p, const char *where, const char *name,
                                       kmp_expr_symbol symbol);

/** A node whose column is the column of `where`. */
const kmp_expr *kmp_parse_make(struct kmp_parser *p, const char *where, kmp_expr expr);

/** The rule `sum`. */
const kmp_expr *kmp_parse_sum(struct kmp_parser *p);

const char *kmp_function_name(kmp_function function);

/** True for functions that yield to a name of the model: parameters may be called floor, as in older models. */
bool kmp_function_yields(const char *name);

/** Its word, "" if it is not said. */
const char *kmp_outside_word(kmp_outside outside);

/** A node in the arena; NULL: no memory. */
const kmp_expr *kmp_expr_make(kmp_arena *arena, kmp_expr expr);

/** Adds a name to the locals; nothing where `expr` is NULL. */
void kmp_local_put(kmp_expr_locals *locals, const char *name, const kmp_expr *expr);

/** An expression from a text of the program's own, which knows only the names in `locals`; NULL: no memory, or a name
 * is missing. */
const kmp_expr *kmp_expr_formula(kmp_arena *arena, const char *text, const kmp_expr_locals *locals);
