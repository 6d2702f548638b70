/* SPDX-License-Identifier: BSD-3-Clause */
/* A language of generated equations is a row of languages.def and a table: the spelling of numbers, lists and
 * operations, and templates of its files. A template is text with words in $( ), which write.c lists and replaces:
 *
 *     $(name)_$(routine)            names
 *     $(if rows) .. $(end)          text that is there unless the word is empty or 0; also $(if not rows)
 *     $(each routine) .. $(end)     text for each routine in turn
 */
#pragma once

#include "exchange/code/runtime_files.h"
#include "exchange/code/source.h"

typedef struct kmp_code_writer kmp_code_writer;
struct kmp_code_block;

/** Brackets of a list, the text between items, and the one after each `a_line` of them (0: none). */
typedef struct kmp_list_spelling {
    const char *open, *close, *between, *broken;
    int a_line;
} kmp_list_spelling;

/** A function: its name in calls (NULL: the language lacks it), and its definition, a template, where the language has
 * none; another one for arrays where the vectorised form needs it. */
typedef struct kmp_function_spelling {
    const char *call, *definition, *of_arrays;
} kmp_function_spelling;

/** A file; a file with an empty name is left out. */
typedef struct kmp_page {
    const char *name, *text;
} kmp_page;

/** The templates of the vectorised form (vectorised.h); v is the vector of all values. */
typedef struct kmp_array_spelling {
    const char *function;              /* NULL: the language has no vectorised form */
    const char *table;                 /* values of a table for $(operands); NULL: as a call */
    const char *range, *one;           /* results in v as the left side of an assignment; a single one, NULL: as more */
    const char *gather, *gather_one;   /* the values at $(places); at one */
    const char *signs, *plus, *minus;  /* factors 1 and -1; an item of their list */
    const char *scatter;               /* entries of an $(array) at $(places), as the left side of an assignment */
    const char *define, *define_signs; /* a named list of places, of signs; NULL: lists are where they are used */
    const char *times;                 /* between two factors */
    bool by_columns;                   /* the order of the entries of matrices */
} kmp_array_spelling;

typedef struct kmp_language {
    const char *name, *title; /* in options, in sentences */
    int chunk;                /* assignments of a function, a longer one is split; 0: never */
    const char *infinity, *nan;
    char quote, escape; /* of strings; what comes before `escaped` characters */
    const char *escaped;
    kmp_list_spelling names, numbers, places, pieces, piece; /* pieces: polynomials of a table */
    char open, close;                                        /* brackets of an index */
    int base;                                                /* the first index */
    bool flat;                                               /* matrices are rows one after another */
    bool chains;                                             /* a = b = x is possible */
    bool divides_by_call;                                    /* instead of / */
    bool takes_parameters;   /* a routine has p as an argument, the last one, in place of k */
    const char *local, *end; /* before an assignment to a variable, and after each */
    const char *pair;        /* sine and cosine of $(angle) at once; NULL: two assignments */
    const char *comment, *comment_end;
    const char *mark, *routine_mark;        /* at the beginning of lines about the file, about a routine */
    const char *table_call;                 /* up to the abscissa; NULL: the language lacks tables */
    const kmp_function_spelling *functions; /* by operation; NULL: these two */
    void (*call)(const kmp_code_writer *writer, kmp_op op);
    void (*define)(const kmp_code_writer *writer, kmp_op op);
    const char *prepare, *function;             /* of the parameters; of a routine */
    const char *inner_prepare, *inner_function; /* of the parts of blocks; NULL: the names of routines */
    /* Implicit blocks: the function that solves one, after the functions of its parts; a call of it for $(argument),
     * which sets the array $(what). NULL: the language lacks them. */
    void (*block)(const kmp_code_writer *writer, const struct kmp_code_block *block, int number);
    const char *solve;
    kmp_runtime_file newton;                        /* what blocks are solved with */
    kmp_runtime_file helpers;                       /* what all functions need */
    const char *part, *part_call;                   /* of a split function */
    void (*forward)(const kmp_code_writer *writer); /* functions of accelerations; NULL: none */
    kmp_array_spelling arrays;
    kmp_page pages[5], routine_pages[3]; /* up to the first without a text; the others for each routine */
} kmp_language;

#define KMP_LANGUAGE(name) extern const kmp_language kmp_language_##name;
#include "exchange/code/languages.def"
#undef KMP_LANGUAGE

struct kmp_scalar;
struct kmp_nesting_levels;

/** A text that is being written, and what its words mean there. */
struct kmp_code_writer {
    kmp_text *text;
    const kmp_language *language;
    const kmp_code_source *source;
    const kmp_code_routine *routine; /* NULL: all of them */
    const struct kmp_scalar *scalar;
    const struct kmp_nesting_levels *levels;
    const kmp_text *statements;
    unsigned used, arrays; /* arguments that are read, arrays that are written, as bits */
    int part;              /* of a split function, from 1 on; 0: the whole */
    int table, derivative;
    const kmp_array *array;
    const char *mark; /* of comments */
    int kind;         /* of an argument */
    const char *argument, *angle, *sine, *cosine;
    int group, first, last; /* of the vectorised form: of a group; places in v, from the first index to the last */
    const char *what;       /* of a list of places or signs, with its number and its items */
    int number, count;
    const int *places;
    const bool *signs;
};
