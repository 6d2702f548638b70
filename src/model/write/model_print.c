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
const char *const kmp_inertia_names[6] = {"xx", "yy", "zz", "xy", "xz", "yz"};

void kmp_model_settings(const kmp_run_settings *run, kmp_shown_setting list[KMP_SETTINGS])
{
    bool automatic = run->dynamics == KMP_DYNAMICS_AUTO, cross = run->change_points == KMP_CHANGE_POINTS_CROSS;
    const kmp_shown_setting all[KMP_SETTINGS] = {
        {"t_end", false, run->t_end, NULL},
        {"output_step", false, run->output_step, NULL},
        {"rtol", false, run->rtol, NULL},
        {"atol", false, run->atol, NULL},
        {"max_step", false, run->max_step, NULL},
        {"max_steps", false, (double)run->max_steps, NULL},
        {"formulation", true, 0, run->formulation},
        {"form", true, 0, run->form},
        {"integrator", true, 0, run->integrator},
        {"algorithm", true, 0, automatic ? NULL : kmp_dynamics_word(run->dynamics)},
        {"change_points", true, 0, cross ? NULL : kmp_change_points_word(run->change_points)},
    };
    memcpy(list, all, sizeof all);
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
