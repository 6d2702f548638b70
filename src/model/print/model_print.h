/* SPDX-License-Identifier: BSD-3-Clause */
/* The two forms in which a model is printed, and the pieces that they share. */
#ifndef KMP_MODEL_PRINT_MODEL_PRINT_H
#define KMP_MODEL_PRINT_MODEL_PRINT_H

#include "base/text.h"
#include "model/model.h"

/** A summary to read; one JSON object. */
void kmp_model_show(kmp_text *text, const kempe_model *model);
void kmp_model_json(kmp_text *text, const kempe_model *model);
/** The JSON object of the mechanism without its run settings and its end: the input of the equations. */
void kmp_model_json_mechanism(kmp_text *text, const kempe_model *model);

/** Profiles and tracks of either form (model_tracks.c): nothing where there are none. */
void kmp_model_show_tracks(kmp_text *text, const kempe_model *model);
void kmp_model_json_tracks(kmp_text *text, const kempe_model *model);

/** The summary of wheels (model_wheels.c). */
void kmp_model_show_wheels(kmp_text *text, const kempe_model *model);
void kmp_model_json_wheels(kmp_text *text, const kempe_model *model);

/** "C: revolute, cut as revolute of 5 rows, loop coupler - .. - rocker: it comes after B". */
void kmp_cut_print(kmp_text *text, const kmp_cut *cut);

void kmp_model_put_expr(kmp_text *text, const kempe_model *model, const kmp_expr *expr);
void kmp_model_put_quoted_expr(kmp_text *text, const kempe_model *model, const kmp_expr *expr);
void kmp_model_put_vector(kmp_text *text, const kmp_number vector[3]);
void kmp_model_put_point(kmp_text *text, const kempe_model *model, int index);           /* BODY.POINT */
void kmp_model_put_goal(kmp_text *text, const kempe_model *model, const kmp_goal *goal); /* A, position(BODY.POINT) */
void kmp_model_put_axis(kmp_text *text, const double axis[3]);
bool kmp_closure_has_axes(const kmp_closure *closure);
extern const char *const kmp_inertia_names[6];

#endif
