/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces that depend on the multipliers of closures, and forces and closures that depend on time. */
#include "model/read/loads.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"
#include "model/read/law_warnings.h"
#include <string.h>

const kmp_expr *kmp_force_lambda(const kmp_force *force)
{
    const kmp_expr *found = kmp_expr_lambda(force->effort);
    found = found ? found : kmp_expr_lambda(force->holding_effort);
    for (int k = 0; !found && k < 3; k++)
        found = kmp_expr_lambda(force->vector[k]);
    return found;
}

bool kmp_force_has_load(const kmp_force *force)
{
    return force->contact > 0 || kmp_force_lambda(force);
}

/* True for a law of its own, or a wheel's creep under its normal force. */
static bool is_loaded(const kempe_model *model, int force)
{
    bool wheel = false;
    for (int k = 0; k < model->wheel_count; k++)
        wheel = wheel || (model->wheels[k].force == force && model->wheels[k].form == KMP_CONTACT_RIGID);
    return wheel || kmp_force_has_modes(&model->forces[force]) || kmp_force_lambda(&model->forces[force]);
}

bool kmp_model_has_loads(const kempe_model *model)
{
    for (int k = 0; k < model->force_count; k++)
        if (is_loaded(model, k))
            return true;
    for (int k = 0; k < model->sensor_count; k++)
        if (kmp_expr_lambda(model->sensors[k].expr))
            return true;
    return false;
}

bool kmp_output_has_loads(const kempe_model *model, const kmp_output *output)
{
    switch (output->kind) {
    case KMP_OUTPUT_LAMBDA:
    case KMP_OUTPUT_REACTION:
    case KMP_OUTPUT_MOMENT:
    case KMP_OUTPUT_JOINT_REACTION:
    case KMP_OUTPUT_JOINT_MOMENT:
        return true;
    case KMP_OUTPUT_FORCE:
        return is_loaded(model, output->index);
    case KMP_OUTPUT_CONTACT:
    case KMP_OUTPUT_GUIDANCE:
        return model->wheels[output->index].form == KMP_CONTACT_RIGID;
    case KMP_OUTPUT_SENSOR:
        return kmp_expr_lambda(model->sensors[output->index].expr);
    default:
        return false;
    }
}

int kmp_model_friction_count(const kempe_model *model)
{
    int count = 0;
    for (int k = 0; k < model->force_count; k++)
        count += kmp_force_has_modes(&model->forces[k]);
    return count;
}

bool kmp_model_has_contacts(const kempe_model *model)
{
    for (int k = 0; k < model->force_count; k++)
        if (model->forces[k].kind == KMP_FORCE_TOUCH)
            return true;
    return false;
}

static bool force_has_time(const kmp_force *force)
{
    bool found = kmp_expr_has_time(force->effort) || kmp_expr_has_time(force->holding_effort) ||
                 kmp_expr_has_time(force->sliding) || kmp_expr_has_time(force->touch.gap);
    for (int k = 0; k < 3; k++)
        found = found || kmp_expr_has_time(force->vector[k]);
    return found;
}

static bool closure_has_time(const kmp_closure *closure)
{
    bool found = kmp_expr_has_time(closure->function);
    for (int k = 0; k < closure->curve_count && k < 2; k++)
        found = found || kmp_expr_has_time(closure->curve[k]);
    return found;
}

void kmp_model_begin(const kempe_model *model)
{
    kmp_context_begin(model->context);
    for (int k = 0; k < model->note_count; k++)
        kmp_context_recall(model->context, model->notes[k], model->altered);
}

void kmp_model_begin_forces(const kempe_model *model)
{
    kmp_model_begin(model);
    kmp_warn_of_directions(model);
    kmp_warn_of_couplers(model);
    kmp_warn_of_planes(model);
}

bool kmp_model_has_time(const kempe_model *model)
{
    bool found = false;
    for (int k = 0; k < model->force_count; k++)
        found = found || force_has_time(&model->forces[k]);
    for (int k = 0; k < model->closure_count; k++)
        found = found || closure_has_time(&model->closures[k]);
    return found;
}

typedef struct input_of {
    int input;
} input_of;

static bool is_input(const kmp_expr *expr, const void *user)
{
    return expr->kind == KMP_EXPR_INPUT && expr->index == ((const input_of *)user)->input;
}

const kmp_closure *kmp_model_moved_by(const kempe_model *model, int input)
{
    const input_of wanted = {input};
    for (int k = 0; k < model->closure_count; k++) {
        const kmp_closure *closure = &model->closures[k];
        bool found = kmp_expr_find(closure->function, is_input, &wanted);
        for (int i = 0; i < closure->curve_count && i < 2; i++)
            found = found || kmp_expr_find(closure->curve[i], is_input, &wanted);
        if (found)
            return closure;
    }
    return NULL;
}

void kmp_model_times(const kempe_model *model, double t, double *vector)
{
    vector[0] = t;
    for (int k = 0; k < model->input_count; k++) {
        kmp_signal_piece piece = kmp_signal_at(&model->inputs[k].signal, t);
        kmp_signal_values(&piece, t, vector + 1 + 3 * k);
    }
}
