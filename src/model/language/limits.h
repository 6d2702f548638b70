/* SPDX-License-Identifier: BSD-3-Clause */
/* Limits of model parts that cost more than their length, or memory of the stack. Beyond them the reader reports an
 * error; docs/model/limits.md lists these numbers too. */
#pragma once

enum {
    KMP_MOST_EXPRESSION_LEVELS = 200, /* functions that traverse the tree recurse */
    KMP_MOST_EXPRESSION_NODES = 4000,
    KMP_MOST_BRACKETS = 1000,     /* nested brackets of YAML: libyaml takes time that grows with their square */
    KMP_MOST_ANCHORS = 1000,      /* libyaml searches all of them for each alias */
    KMP_MOST_ELEMENTS = 100,      /* nested elements of XML */
    KMP_MOST_ATTRIBUTE = 1000000, /* characters of an attribute in XML: they may be a name, which messages repeat */
    KMP_MOST_SHAPES = 200,        /* of a body: the sum of their masses is an expression of this number of levels */
    KMP_MOST_TRIANGLES = 2000000, /* of a mesh */
    KMP_MOST_INCLUDE_LEVELS = 16,
    KMP_MOST_INCLUDES = 1000,       /* each level may include the next one twice */
    KMP_MOST_COURSE_KNOTS = 200000, /* of the middle line of a track */
    KMP_MOST_SPECTRUM_KNOTS = 20000 /* of irregularities: time grows with their square */
};

/* A time is a multiple of the sample time up to this part of it: both are decimal numbers that were rounded. */
#define KMP_WHOLE_SAMPLES 1e-9

#define KMP_MOST_STEPS 1e15 /* the largest max_steps */
