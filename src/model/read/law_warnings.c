/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/read/law_warnings.h"
#include "model/data/model.h"
#include "model/language/expression_references.h"
#include "model/language/expression_value.h"

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
    bool compares = calls(e, KMP_FUNCTION_sign) || (e->kind >= KMP_EXPR_LESS && e->kind <= KMP_EXPR_AT_LEAST);
    if (compares && (has_direction(e->a) || has_direction(e->b)))
        return true;
    if (e->kind == KMP_EXPR_UNKNOWN)
        return e->unknowns && e->unknowns->count == 0 && jumps_by_direction(e->unknowns->zero[0]);
    return jumps_by_direction(e->a) || jumps_by_direction(e->b) || jumps_by_direction(e->c);
}

void kmp_warn_of_directions(const kempe_model *model)
{
    for (const kmp_force *f = model->forces; f < model->forces + model->force_count; f++)
        if (f->kind == KMP_FORCE_FRICTION && kmp_force_sticks(f) &&
            (jumps_by_direction(f->effort) || jumps_by_direction(f->holding_effort)))
            kmp_log(model->context, KEMPE_LOG_WARNING,
                    "friction '%s': its level depends on the direction of motion, but at rest one level holds both "
                    "ways, that of zero rates: it is no capstan, no one-way clutch and no gear with losses; give it a "
                    "'speed', so that it does not stick",
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

void kmp_warn_of_couplers(const kempe_model *model)
{
    for (const kmp_closure *c = model->closures; c < model->closures + model->closure_count; c++)
        for (int k = 0; k < c->term_count; k++) {
            int body = model->motions[c->terms[k].motion].body;
            if (has_reaction(model, body))
                kmp_log(model->context, KEMPE_LOG_WARNING,
                        "the reaction of joint '%s' is without the load of coupler '%s', which acts on coordinates and "
                        "has no force between teeth: that is lambda(%s) over the radius",
                        model->bodies[body].joint, c->name, c->name);
        }
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

void kmp_warn_of_planes(const kempe_model *model)
{
    for (const kmp_force *f = model->forces; model->pressed_plane && f < model->forces + model->force_count; f++) {
        const kmp_expr *size = f->kind == KMP_FORCE_FRICTION ? kmp_expr_find(f->effort, is_size, NULL) : NULL;
        const kmp_closure *of = size ? &model->closures[size->index] : NULL;
        int body = of && of->motion >= 0 ? model->motions[of->motion].body : -1;
        const kmp_closure *loop = body >= 0 && slides(model, body) ? loop_with(model, body) : NULL;
        bool turns = f->motion >= 0 ? model->motions[f->motion].rotation : f->turns;
        if (loop)
            kmp_log(model->context, KEMPE_LOG_WARNING,
                    "friction '%s': what presses joint '%s' across the plane of the mechanism is all on this joint; "
                    "loop '%s' may take a part of it, which is not determined, and counts as none",
                    f->name, model->bodies[body].joint, loop->name);
        else if (of && body < 0 && of->point[0] >= 0 && !turns)
            kmp_doubt(
                model->context,
                "friction '%s': what presses '%s' across the plane of the mechanism is not in its friction, since "
                "rows that no coordinate moves have no force; let the friction have the reaction of a joint of "
                "the tree, or give the mechanism a joint that tilts",
                f->name, of->name);
    }
}

static bool is_kink(const kmp_expr *e, const void *unused)
{
    (void)unused;
    return calls(e, KMP_FUNCTION_abs) || calls(e, KMP_FUNCTION_min) || calls(e, KMP_FUNCTION_max);
}

void kmp_warn_of_implicit_kinks(const kempe_model *model)
{
    for (int i = 0; i < model->unknowns_count; i++) {
        const kmp_unknowns *u = &model->unknowns[i];
        bool kinks = false;
        for (int k = 0; k < u->count; k++)
            kinks = kinks || kmp_expr_find(u->zero[k], is_kink, NULL);
        if (kinks)
            kmp_log(
                model->context, KEMPE_LOG_WARNING,
                "implicit variable '%s': kinks of abs, min and max in its equations are not located, and cost steps "
                "and accuracy; write them with if(..), or in the force",
                u->unknown[0]);
    }
}
