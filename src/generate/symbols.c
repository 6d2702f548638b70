/* SPDX-License-Identifier: BSD-3-Clause */
/* Searches all numbers of a model; the one with the symbol gives the name. */
#include "generate/symbols.h"
#include "model/print/model_print.h"
#include "model/tables/force_table.h"
#include <string.h>

static const char *const xyz[3] = {"x", "y", "z"};

/* Appends the name when the number has the symbol. */
static bool is_it(kmp_text *text, int symbol, const kmp_number *number, const char *owner, const char *what)
{
    if (number->symbol != symbol)
        return false;
    kmp_text_printf(text, "%s.%s", owner, what);
    return true;
}

static bool in_vector(kmp_text *text, int symbol, const kmp_number v[3], const char *owner, const char *what)
{
    for (int k = 0; k < 3; k++)
        if (v[k].symbol == symbol) {
            kmp_text_printf(text, "%s.%s%s%s", owner, what, *what ? "." : "", xyz[k]);
            return true;
        }
    return false;
}

/* A law that is one number. */
static bool is_law(kmp_text *text, int symbol, const kmp_expr *law, const char *owner, const char *what)
{
    if (!law || law->symbol != symbol)
        return false;
    kmp_text_printf(text, "%s.%s", owner, what);
    return true;
}

static bool in_body(kmp_text *text, int symbol, const kmp_body *body)
{
    if (is_it(text, symbol, &body->mass, body->name, "mass") || in_vector(text, symbol, body->com, body->name, "com") ||
        is_it(text, symbol, &body->pitch, body->name, "pitch"))
        return true;
    for (int k = 0; k < 6; k++)
        if (body->inertia[k].symbol == symbol) {
            kmp_text_printf(text, "%s.inertia.%s", body->name, kmp_inertia_names[k]);
            return true;
        }
    return false;
}

static bool in_closure(kmp_text *text, int symbol, const kempe_model *model, const kmp_closure *closure)
{
    if (is_it(text, symbol, &closure->length, closure->name, "length") ||
        (closure->constant && is_it(text, symbol, closure->constant, closure->name, "equals")) ||
        is_law(text, symbol, closure->function, closure->name, "function") ||
        is_law(text, symbol, closure->curve[0], closure->name, "curve.1") ||
        is_law(text, symbol, closure->curve[1], closure->name, "curve.2"))
        return true;
    for (int k = 0; k < closure->term_count; k++)
        if (is_it(text, symbol, &closure->terms[k].factor, closure->name,
                  model->motions[closure->terms[k].motion].name))
            return true;
    return false;
}

static bool in_force(kmp_text *text, int symbol, const kmp_force *force)
{
    for (int k = 0; k < kmp_force_field_count; k++)
        if (kmp_force_fields[k].kind != force->kind)
            continue;
        else if (kmp_force_fields[k].size == 3
                     ? in_vector(text, symbol, kmp_force_get(force, k), force->name, kmp_force_fields[k].key)
                     : is_it(text, symbol, kmp_force_get(force, k), force->name, kmp_force_fields[k].key))
            return true;
    for (int k = 0; k < 3; k++)
        if (is_law(text, symbol, force->vector[k], force->name, xyz[k]))
            return true;
    return is_law(text, symbol, force->effort, force->name, "effort");
}

static bool in_unknowns(kmp_text *text, int symbol, const kmp_unknowns *u)
{
    return u->count == 0 && is_law(text, symbol, u->zero[0], u->name, "value");
}

static bool in_start(kmp_text *text, int symbol, const kempe_model *model)
{
    for (int k = 0; k < model->motion_count; k++)
        if (is_it(text, symbol, &model->start.q[k], "start.q", model->motions[k].name) ||
            is_it(text, symbol, &model->start.qd[k], "start.qd", model->motions[k].name))
            return true;
    return false;
}

static bool find(kmp_text *text, int symbol, const kempe_model *model)
{
    bool found = false;
    for (int k = 0; k < 3 && !found; k++)
        found = is_it(text, symbol, &model->gravity[k], "gravity", xyz[k]);
    for (int b = 1; b < model->body_count && !found; b++)
        found = in_body(text, symbol, &model->bodies[b]);
    for (int k = 0; k < model->point_count && !found; k++) {
        const kmp_point *point = &model->points[k];
        found = in_vector(text, symbol, point->at, model->bodies[point->body].name, point->name ? point->name : "");
    }
    for (int k = 0; k < model->closure_count && !found; k++)
        found = in_closure(text, symbol, model, &model->closures[k]);
    for (int k = 0; k < model->force_count && !found; k++)
        found = in_force(text, symbol, &model->forces[k]);
    for (int k = 0; k < model->unknowns_count && !found; k++)
        found = in_unknowns(text, symbol, &model->unknowns[k]);
    return found || in_start(text, symbol, model);
}

char *kmp_symbol_name(kmp_arena *arena, const kempe_model *model, int k)
{
    kmp_text text = {0};
    int symbol = k - model->parameter_count + 1;
    if (symbol <= 0)
        kmp_text_put(&text, model->parameters[k].name);
    else if (!find(&text, symbol, model))
        kmp_text_printf(&text, "number.%d", symbol);
    return kmp_text_keep(&text, arena);
}
