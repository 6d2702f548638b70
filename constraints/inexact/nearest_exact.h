/* SPDX-License-Identifier: BSD-3-Clause */
/* The exact mechanism of a rounded drawing: of all mechanisms with exactly redundant closures the one with the nearest
 * points and axes. */
#pragma once

#include "constraints/closing/assemble.h"
#include "model/data/variant.h"

/** The system of a model: its equations, derived and scheduled as programs, or as an earlier process kept them. If the
 * drawing is rounded they belong to the exact mechanism. word: of a row of dynamics.def; NULL: the model's. */
kempe_status kmp_system_new(const kempe_model *model, const char *word, kempe_system **system);

/** Makes a system as kmp_system_new for the model of a variant, with the points and axes of the exact mechanism;
 * parameters that vary keep these shifts. */
kempe_status kmp_system_of_variant(kmp_variant *variant, kempe_system **system);

/** Returns the exact mechanism of a rounded drawing; NULL: the model is exact as written. The caller frees it. */
kempe_status kmp_meant(const kempe_model *model, kmp_variant **meant);

/** Appends a sentence with the gap of a closure as drawn; nothing if it closes. */
void kmp_put_misfit(kmp_text *text, const kempe_system *system, int closure);

/** A rounded drawing has an exact mechanism nearby; or rows stay open, explained by rounding of its numbers or not. */
typedef enum kmp_drawn_model { KMP_DRAWING_OPEN, KMP_DRAWING_UNEXPLAINED, KMP_DRAWING_EXACT } kmp_drawn_model;
