/* SPDX-License-Identifier: BSD-3-Clause */
/* The path of a rope over points, round sheaves and from drums. Its elements are words of the language that the reader
 * writes (model/read/rope_elements.c); they have its lengths by measures. */
#pragma once

#include "model/data/place.h"
#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <stdbool.h>

/** A coordinate that turns a drum, in the sense 1: to the left as seen against the axis of the rope, or -1. */
typedef struct kmp_rope_turning {
    int motion, sense;
} kmp_rope_turning;

/** One place of a path. Of a drum, on which the rope ends, and of a sheave with friction the rotation counts: it is the
 * sum of coordinates between it and the body `carrier`. */
typedef struct kmp_rope_place {
    int point;
    int turn;    /* 1: the rope turns to the left as seen against the axis of the rope, -1: right; 0: a point */
    int axis;    /* of a turn: of its point's axes */
    bool drum;   /* the rope ends on it */
    bool leaves; /* the rope may leave this sheave and meet it again; one place of a part */
    bool ball;   /* a sphere between two points, whose plane has them: its turn is to the left about that plane */
    bool helix;  /* a cylinder between two points, on which the rope may rise along the axis */
    bool turns;  /* its rotation counts */
    int carrier; /* body */
    int turning_count;
    kmp_rope_turning *turning;
    double wrap;       /* of a sheave: angle at the start, with full turns; the other values are continuous from here */
    double toward[3];  /* if its rotation counts: the direction of its span at the start, in the axes of the carrier */
    kmp_number radius; /* with layers: at the start */
    const kmp_named_table *layers; /* drum: its radius over the angle that is wound on it, in straight lines; or NULL */
    double wound;                  /* with layers: this angle at the start */
} kmp_rope_place;

/** A rope is held taut by a closure, by a rigid contact of its slack, or by a contact with a law of its slack; or it
 * has a force along its path. */
typedef enum kmp_rope_kind { KMP_ROPE_TAUT, KMP_ROPE_PULLS, KMP_ROPE_ELASTIC, KMP_ROPE_LAW } kmp_rope_kind;

typedef struct kmp_rope {
    const char *name; /* of its element, too */
    kmp_place place;
    kmp_rope_kind kind;
    bool closed;            /* it returns to its first place */
    bool parts;             /* each part between two points has its own plane */
    int plane;              /* the first place with a turn, whose axis the rope has; -1: it has only points */
    const kmp_expr *length; /* its free length, of t; NULL: as at the start */
    bool axial;             /* the stiffness is E A in N, otherwise N/m of the whole rope */
    kmp_number stiffness;   /* 0: inextensible */
    kmp_number preload;     /* N, at the start */
    bool damped;            /* an elastic one */
    double at_start;        /* its length then: of the path, or free */
    int count;
    kmp_rope_place *places;
} kmp_rope;

/** Places whose wrap is an angle of the path: sheaves between the ends, or all of a closed one. */
static inline bool kmp_rope_wraps(const kmp_rope *rope, int place)
{
    return rope->places[place].turn != 0 && !rope->places[place].drum;
}

/** A part of a belt between two wheels with grip, or drums: its strain is its elongation over its length. */
static inline bool kmp_rope_is_belt(const kmp_rope *rope)
{
    return rope->places[0].drum && rope->places[rope->count - 1].drum;
}

/** The place that a part of a rope may leave; -1: there is none. */
static inline int kmp_rope_leaving(const kmp_rope *rope)
{
    int k = rope->count - 1;
    while (k >= 0 && !rope->places[k].leaves)
        k--;
    return k;
}

/** The next place, or with the step -1 the one before. A place that the rope is off (-1: none) does not count. */
static inline int kmp_rope_next(const kmp_rope *rope, int k, int step, int without)
{
    do
        k = (k + rope->count + step) % rope->count;
    while (k == without);
    return k;
}

/** The number of spans. Span k is from place k to the next one. */
static inline int kmp_rope_spans(const kmp_rope *rope)
{
    return rope->closed ? rope->count : rope->count - 1;
}

/** The part of a path from the place *first on, which becomes the end of the part: the whole path, or up to the next
 * point. False: none is left. */
bool kmp_rope_part(const kmp_rope *rope, int *first, kmp_rope *part);

/** Words of the log for a contact, for the beginning of its pressure, and for the end. */
typedef struct kmp_contact_words {
    const char *noun, *begins, *ends;
} kmp_contact_words;

/** The words of the contact with a name: if it is the element of a rope, the words of ropes. */
kmp_contact_words kmp_contact_words_of(const kempe_model *model, const char *contact);
