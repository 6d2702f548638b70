/* SPDX-License-Identifier: BSD-3-Clause */
/* Forces that depend on the multipliers of closures, or on time; warnings of laws that mean less than they say. */
#include "model/read/loads.h"
#include "model/data/model.h"
#include "model/data/rope.h"
#include "model/language/expression_references.h"
#include "model/language/expression_value.h"
#include <string.h>

/* -- warnings of laws -------------------------------------------------------------------------------- */

static bool calls(const kmp_expr *e, kmp_function function)
{
    return e->kind == KMP_EXPR_CALL && e->function == function;
}

/* True if the sign of a rate matters to an expression. */
static bool has_direction(const kmp_expr *e)
{
    if (!e || calls(e, KMP_FUNCTION_abs))
        return false;
    return kmp_expr_is_rate(e, NULL) || has_direction(e->a) || has_direction(e->b) || has_direction(e->c);
}

/* True for an expression that jumps where a rate changes its direction. */
static bool jumps_by_direction(const kmp_expr *e)
{
    if (!e || calls(e, KMP_FUNCTION_abs))
        return false;
    if (kmp_expr_compares(e, NULL) && (has_direction(e->a) || has_direction(e->b)))
        return true;
    if (e->kind == KMP_EXPR_UNKNOWN)
        return e->unknowns && e->unknowns->count == 0 && jumps_by_direction(e->unknowns->zero[0]);
    return jumps_by_direction(e->a) || jumps_by_direction(e->b) || jumps_by_direction(e->c);
}

/* Warns of friction that sticks whose level jumps with the direction of a rate: at rest one level holds both ways. */
static void warn_of_directions(const kempe_model *model)
{
    for (const kmp_force *f = model->forces; f < model->forces + model->force_count; f++)
        if (f->kind == KMP_FORCE_FRICTION && kmp_force_sticks(f) &&
            (jumps_by_direction(f->effort) || jumps_by_direction(f->holding_effort)))
            kmp_log(model->context, KEMPE_LOG_WARNING,
                    "friction '%s': its level depends on the direction of motion, but at rest the level at zero "
                    "velocity acts both ways. Give a list of two levels",
                    f->name);
}

/* True if an output or friction has the reaction or the moment of the joint that carries a body. */
static bool has_reaction(const kempe_model *model, int body)
{
    bool found = model->bodies[body].load_count > 0;
    for (const kmp_output *o = model->outputs; o < model->outputs + model->output_count; o++)
        found = found ||
                ((o->kind == KMP_OUTPUT_JOINT_REACTION || o->kind == KMP_OUTPUT_JOINT_MOMENT) && o->index + 1 == body);
    return found;
}

/* True if body b carries another one, or is it. */
static bool is_below(const kempe_model *model, int body, int b)
{
    while (body > 0 && body != b)
        body = model->bodies[body].parent;
    return body == b;
}

/* A closure between points whose loop has the joint that carries a body; NULL: there is none. */
static const kmp_closure *loop_with(const kempe_model *model, int body)
{
    for (const kmp_closure *c = model->closures; c < model->closures + model->closure_count; c++) {
        bool joins = c->point[0] >= 0 && c->point[1] >= 0;
        if (joins && is_below(model, model->points[c->point[0]].body, body) !=
                         is_below(model, model->points[c->point[1]].body, body))
            return c;
    }
    return NULL;
}

static bool is_size(const kmp_expr *e, const void *unused)
{
    (void)unused;
    return e->kind == KMP_EXPR_LAMBDA && e->number < 0 && !e->measure;
}

bool kmp_model_presses_friction(const kempe_model *model)
{
    bool any = false;
    for (int k = 0; k < model->force_count && !any; k++)
        any = model->forces[k].kind == KMP_FORCE_FRICTION && kmp_expr_find(model->forces[k].effort, is_size, NULL);
    return any;
}

/* True for the joint of a body with a translation: a load across the plane presses it. That of a pin is along its axis.
 */
static bool slides(const kempe_model *model, int body)
{
    const kmp_body *b = &model->bodies[body];
    bool found = false;
    for (int k = b->first_motion + b->load_count; k < b->first_motion + b->motion_count; k++)
        found = found || !model->motions[k].rotation;
    return found;
}

/* Warns of friction by the reaction of a joint, or of a closure, that a force across the plane of a plane mechanism
 * may press: closures carry nothing across it. */
static void warn_of_planes(const kempe_model *model)
{
    for (const kmp_force *f = model->forces; model->pressed_plane && f < model->forces + model->force_count; f++) {
        const kmp_expr *size = f->kind == KMP_FORCE_FRICTION ? kmp_expr_find(f->effort, is_size, NULL) : NULL;
        const kmp_closure *of = size ? &model->closures[size->index] : NULL;
        int body = of && of->motion >= 0 ? model->motions[of->motion].body : -1;
        const kmp_closure *loop = body >= 0 && slides(model, body) ? loop_with(model, body) : NULL;
        bool turns = f->motion >= 0 ? model->motions[f->motion].rotation : f->turns;
        if (loop)
            kmp_log(model->context, KEMPE_LOG_WARNING,
                    "friction '%s': joint '%s' carries the whole load across the plane of the mechanism; the share of "
                    "loop '%s' is not unique, and is taken as zero",
                    f->name, model->bodies[body].joint, loop->name);
        else if (of && body < 0 && of->point[0] >= 0 && !turns)
            kmp_doubt(model->context,
                      "friction '%s' lacks the load of '%s' across the plane of the mechanism: use the reaction of a "
                      "joint of the tree, or add a joint that tilts",
                      f->name, of->name);
    }
}

/* -- what depends on multipliers, what on time --------------------------------------------------------- */

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

/* True for a separate law, or a wheel's creep under its normal force. */
static bool is_loaded(const kempe_model *model, int force)
{
    bool wheel = false;
    if (force < 0) /* a path without a force */
        return false;
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
    case KMP_OUTPUT_BEARING:
    case KMP_OUTPUT_CAM_FORCE:
        return true;
    case KMP_OUTPUT_FORCE:
        return is_loaded(model, output->index);
    case KMP_OUTPUT_OUTLINE_FORCE:
        return is_loaded(model, model->outline_contacts[output->index].first);
    case KMP_OUTPUT_CONTACT:
    case KMP_OUTPUT_GUIDANCE:
        return model->wheels[output->index].form == KMP_CONTACT_RIGID;
    case KMP_OUTPUT_TENSION:
        return model->ropes[output->index].kind == KMP_ROPE_LAW
                   ? is_loaded(model, kmp_name_find(KMP_NAMED(model, force), model->ropes[output->index].name))
                   : model->ropes[output->index].kind != KMP_ROPE_ELASTIC;
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

void kmp_model_begin(const kempe_model *model)
{
    kmp_context_begin(model->context);
    for (int k = 0; k < model->source.note_count; k++)
        kmp_context_recall(model->context, model->source.notes[k], model->source.altered);
}

/* Warns of reactions, as outputs and in friction by `mu`, of joints that a coupler moves: it has no force in space. */
static void warn_of_couplers(const kempe_model *model)
{
    for (const kmp_closure *c = model->closures; c < model->closures + model->closure_count; c++)
        for (int k = 0; k < c->term_count && !c->gear; k++) {
            int body = model->motions[c->terms[k].motion].body;
            if (has_reaction(model, body))
                kmp_log(model->context, KEMPE_LOG_WARNING,
                        "the reaction of joint '%s' is without the load of coupler '%s', which acts on coordinates and "
                        "has no force between teeth: that is lambda(%s) over the radius",
                        model->bodies[body].joint, c->name, c->name);
        }
}

void kmp_model_begin_forces(const kempe_model *model)
{
    kmp_model_begin(model);
    warn_of_directions(model);
    warn_of_couplers(model);
    warn_of_planes(model);
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
