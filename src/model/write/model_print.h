/* SPDX-License-Identifier: BSD-3-Clause */
/* The two forms in which a model is printed, and the pieces that they share. */
#pragma once

#include "base/json.h"
#include "model/data/body.h"
#include "model/data/closure.h"
#include "model/data/force.h"
#include "model/data/run_settings.h"
#include "model/data/shape.h"
#include "model/data/start.h"
#include "model/data/touch.h"
#include <kempe/kempe.h>
#include <stddef.h>

/** Pair of surfaces of a contact; in JSON as members of an open object. */
void kmp_pair_show(kmp_text *text, const kempe_model *model, const kmp_contact_pair *pair);
void kmp_pair_json(kmp_json *json, const kempe_model *model, const kmp_contact_pair *pair);

/** Shapes: one as a line, all of them, one as members of an open object. */
void kmp_model_show_shape(kmp_text *text, const kmp_shape *shape);
void kmp_model_json_shapes(kmp_json *json, const kempe_model *model);
void kmp_model_json_shape(kmp_json *json, const kmp_shape *shape);

/** Mass, com and inertia of a body, without deformation, as members of an open object. */
void kmp_model_json_mass(kmp_json *json, const kempe_model *model, int body);

/** A section of a wing (base/wings.h), behind the tables or behind the bodies; a row without a section ends them. */
typedef struct kmp_writer_wing {
    const char *section;
    size_t list, count; /* members of kempe_model: entries that begin with their names, and their number */
    size_t size;        /* of an entry */
    bool behind_bodies;
    void (*put)(kmp_json *json, const kempe_model *model, int k);  /* the members of an entry */
    void (*show)(kmp_text *text, const kempe_model *model, int k); /* its lines of the summary; NULL: its members */
} kmp_writer_wing;
#define KMP_WRITTEN(list, kind)                                                                                        \
#list, offsetof(kempe_model, list), offsetof(kempe_model, kind##_count), sizeof(kmp_##kind)

/** The sections of all wings at one of these places; KMP_JSON_WORDS: in the summary. */
void kmp_model_put_wings(kmp_json *json, const kempe_model *model, bool behind_bodies);

/* -- pieces of text ------------------------------------------------------------------ */

void kmp_model_put_expr(kmp_text *text, const kempe_model *model, const kmp_expr *expr);
void kmp_model_put_point(kmp_text *text, const kempe_model *model, int index);           /* BODY.POINT */
void kmp_model_put_goal(kmp_text *text, const kempe_model *model, const kmp_goal *goal); /* A, position(BODY.POINT) */
bool kmp_closure_has_axes(const kmp_closure *closure);
/** "x", "y", "z" */
extern const char *const kmp_axis_names[3];

/** The settings of a run that are a word or a number, with their keys: rows of run_options.def, algorithm,
 * change_points and reaction_peaks. */
enum {
#define KMP_RUN_OPTION(name, type, key, ...) KMP_RUN_IF_KEY_##key(KMP_SETTING_##name, )
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
    KMP_SETTINGS_OF_KEYS,
    KMP_SETTINGS = KMP_SETTINGS_OF_KEYS + 3
};
typedef struct kmp_shown_setting {
    const char *key;
    bool is_word;
    double number;    /* 0: not given */
    const char *word; /* NULL: not given */
} kmp_shown_setting;
void kmp_model_settings(const kmp_run_settings *run, kmp_shown_setting list[KMP_SETTINGS]);
