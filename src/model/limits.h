/* SPDX-License-Identifier: BSD-3-Clause */
/* How much a model may hold of what costs more than its length, or memory of the stack. Beyond it the reader complains;
 * docs/model_format.md has these numbers too. */
#ifndef KMP_MODEL_LIMITS_H
#define KMP_MODEL_LIMITS_H

enum {
    KMP_MOST_EXPRESSION_LEVELS = 200, /* those who walk the tree recurse */
    KMP_MOST_EXPRESSION_NODES = 4000,
    KMP_MOST_BRACKETS = 1000, /* of YAML, one in the other: libyaml takes time that grows with their square */
    KMP_MOST_ANCHORS = 1000,  /* libyaml goes through all of them for each alias */
    KMP_MOST_ELEMENTS = 100,  /* of XML, one in the other */
    KMP_MOST_INCLUDE_LEVELS = 16,
    KMP_MOST_INCLUDES = 1000,       /* each level may include the next one twice */
    KMP_MOST_COURSE_KNOTS = 200000, /* of the middle line of a track */
    KMP_MOST_SPECTRUM_KNOTS = 20000 /* of irregularities: time goes with their square */
};

#define KMP_MOST_STEPS 1e15 /* that max_steps may ask for */

#endif
