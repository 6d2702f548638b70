/* SPDX-License-Identifier: BSD-3-Clause */
/* Elements that Drake adds to URDF and SDFormat: constraints and forces between points of two bodies. A value is the
 * text of an element (SDFormat), or its attribute `name` or `value` (URDF). */
#pragma once

#include "model/formats/foreign_parts.h"

/** The point BODY.NAME at a place in a frame of the file, which may be a body; NULL after a complaint at e. */
typedef const char *kmp_drake_point(void *reader, const kmp_element *e, const char *frame, const double at[3],
                                    const char *name);

/** Adds the constraints and forces of a model. Their names are those of their kinds with a number, after a prefix. */
void kmp_drake_add(kmp_import *im, const kmp_element *model, const char *prefix, kmp_drake_point *point, void *reader);

/** Words of a grammar: the elements of a model, and rows for what is inside. */
#define KMP_DRAKE_TAGS                                                                                                 \
    " drake:ball_constraint drake:distance_constraint drake:linear_spring_damper drake:linear_bushing_rpy "
#define KMP_DRAKE_GRAMMAR                                                                                              \
    {"drake:ball_constraint", " drake:ball_constraint_body_A drake:ball_constraint_p_AP drake:ball_constraint_body_B " \
                              "drake:ball_constraint_p_BQ "},                                                          \
        {"drake:distance_constraint", " drake:distance_constraint_body_A drake:distance_constraint_p_AP "              \
                                      "drake:distance_constraint_body_B drake:distance_constraint_p_BQ "               \
                                      "drake:distance_constraint_distance drake:distance_constraint_stiffness "        \
                                      "drake:distance_constraint_damping "},                                           \
        {"drake:linear_spring_damper", " drake:linear_spring_damper_body_A drake:linear_spring_damper_p_AP "           \
                                       "drake:linear_spring_damper_body_B drake:linear_spring_damper_p_BQ "            \
                                       "drake:linear_spring_damper_free_length drake:linear_spring_damper_stiffness "  \
                                       "drake:linear_spring_damper_damping "},                                         \
    {                                                                                                                  \
        "drake:linear_bushing_rpy", " drake:bushing_frameA drake:bushing_frameC drake:bushing_torque_stiffness "       \
                                    "drake:bushing_torque_damping drake:bushing_force_stiffness "                      \
                                    "drake:bushing_force_damping "                                                     \
    }
