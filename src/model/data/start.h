/* SPDX-License-Identifier: BSD-3-Clause */
/* The start of a motion, and the goals of assembly. */
#pragma once

#include "model/language/expression.h"
#include <kempe/kempe.h>
#include <stdbool.h>

struct kmp_text;

/** A goal of assembly, approached as far as the closures permit: a coordinate, or the position of a point. */
typedef struct kmp_goal {
    int motion, point; /* -1: not used */
    int width;         /* 1, or 3: x, y, z in ground axes */
    kmp_number value[3], weight[3];
} kmp_goal;

typedef struct kmp_start {
    kmp_number *q, *qd; /* n each, 0 where not given */
    bool *q_given, *qd_given;
    bool *hold;
    bool *undeformed; /* that hold because they are deformations, unless the loops need them to close; NULL: none */
    bool statics;     /* these then move into balance with the loads of the start */
    kmp_goal *goals;
    int goal_count;
    const char *at; /* the equilibrium to which the assembled start leads: "equilibrium", or "equilibrium NAME=RATE,.."
                       (a steady motion); NULL: none, it is the start */
} kmp_start;

/** Reads the state at which a model starts: "start" (*at is NULL then) or an equilibrium, as above. False, with a
 * complaint: another word, or this build has no equilibria. */
bool kmp_start_read_at(const char *word, const char **at, struct kmp_text *complaint);

/** The start of a model. */
const kmp_start *kmp_model_start(const kempe_model *model);
