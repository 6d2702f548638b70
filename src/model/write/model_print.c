/* SPDX-License-Identifier: BSD-3-Clause */
/* The model as the reader understood it: common parts of its summary and its JSON, and the choice of one. */
#include "model/write/model_print.h"
#include <string.h>

void kmp_model_put_expr(kmp_text *text, const kempe_model *model, const kmp_expr *expr)
{
    const kmp_expr_names names = {KMP_NAMED(model, parameter), KMP_NAMED(model, motion), KMP_NAMED(model, closure),
                                  KMP_NAMED(model, input), model->state_count};
    kmp_expr_print(text, expr, &names);
}

void kmp_model_put_point(kmp_text *text, const kempe_model *model, int index)
{
    const kmp_point *point = &model->points[index];
    kmp_text_printf(text, "%s.%s", model->bodies[point->body].name, point->name);
}

void kmp_model_put_goal(kmp_text *text, const kempe_model *model, const kmp_goal *goal)
{
    if (goal->motion >= 0) {
        kmp_text_put(text, model->motions[goal->motion].name);
        return;
    }
    kmp_text_put(text, "position(");
    kmp_model_put_point(text, model, goal->point);
    kmp_text_put(text, ")");
}

bool kmp_closure_has_axes(const kmp_closure *closure)
{
    const double *a = closure->axis[0];
    return a[0] != 0 || a[1] != 0 || a[2] != 0;
}

const char *const kmp_axis_names[3] = {"x", "y", "z"};

void kmp_model_settings(const kmp_run_settings *run, kmp_shown_setting list[KMP_SETTINGS])
{
    bool automatic = run->dynamics == KMP_DYNAMICS_AUTO, cross = run->change_points == KMP_CHANGE_POINTS_CROSS;
    int count = 0;
#define PUT_NUMBER(name) list[count++] = (kmp_shown_setting){#name, false, (double)run->name, NULL};
#define PUT_TEXT(name)   list[count++] = (kmp_shown_setting){#name, true, 0, run->name};
#define KMP_RUN_OPTION(name, type, key, ...)                                                                           \
    KMP_RUN_IF_KEY_##key(KMP_RUN_IF_NUMBER_##type(PUT_NUMBER(name)) KMP_RUN_IF_TEXT_##type(PUT_TEXT(name)))
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
    list[count++] = (kmp_shown_setting){"algorithm", true, 0, automatic ? NULL : kmp_dynamics_word(run->dynamics)};
    list[count++] =
        (kmp_shown_setting){"change_points", true, 0, cross ? NULL : kmp_change_points_word(run->change_points)};
}

kempe_status kempe_model_print(const kempe_model *model, kempe_format format, char **text)
{
    KMP_WANTED_BOTH(model, text);
    kmp_text out = {0};
    kmp_context_clear(model->context);
    KMP_TRY(kmp_model_check_finished(model));
    if (format == KEMPE_JSON)
        kmp_model_json(&out, model);
    else
        kmp_model_show(&out, model);
    char *s = kmp_text_take(&out);
    KMP_TRY(kmp_made(model->context, s));
    *text = s;
    return KEMPE_OK;
}
