/* SPDX-License-Identifier: BSD-3-Clause */
/* Copies the parts of a model that contain numbers; each changed number keeps its expression and is evaluated again
 * when parameters are set. Dependent parameters are ordered by repeated passes over all of them. */
#include "model/variant.h"
#include "base/context.h"
#include "base/memory.h"
#include "model/tables/force_table.h"
#include "model/tables/nearest.h"
#include <math.h>
#include <string.h>

/* A changed number of the copy, and its expression; NULL: its own expression. */
typedef struct follower {
    kmp_number *number;
    const kmp_expr *expr;
} follower;

struct kmp_variant {
    kempe_model model; /* its arena holds the variant's own data */
    const kempe_model *base;
    int count, *parameter; /* by name: which parameter it is */
    double *values;        /* of all parameters */
    int follower_count, follower_room;
    follower *followers;
};

bool kmp_expr_varies(const kempe_model *model, const kmp_expr *expr)
{
    if (!expr)
        return false;
    if (expr->kind == KMP_EXPR_PARAMETER)
        return model->parameters[expr->index].varies;
    return kmp_expr_varies(model, expr->a) || kmp_expr_varies(model, expr->b) || kmp_expr_varies(model, expr->c);
}

/* -- the copy ---------------------------------------------------------------------------------------- */

static void *copy(kmp_variant *v, const void *from, size_t count, size_t size, size_t more)
{
    void *to = kmp_arena_alloc(&v->model.arena, count + more, size);
    if (to && count > 0)
        memcpy(to, from, count * size);
    return to;
}

#define COPY(v, from, count, more) copy((v), (from), (size_t)(count), sizeof *(from), (size_t)(more))

static bool copy_closures(kmp_variant *v)
{
    kempe_model *m = &v->model;
    bool ok = (m->closures = COPY(v, m->closures, m->closure_count, 0));
    for (int c = 0; ok && c < m->closure_count; c++) {
        kmp_closure *closure = &m->closures[c];
        if (closure->terms)
            ok = (closure->terms = COPY(v, closure->terms, closure->term_count, 0));
        if (ok && closure->constant)
            ok = (closure->constant = COPY(v, closure->constant, 1, 0));
    }
    return ok;
}

/* Shares all parts of the model without numbers. */
static bool copy_model(kmp_variant *v, const kempe_model *base, int more)
{
    kempe_model *m = &v->model;
    *m = *base;
    m->arena = (kmp_arena){0};
    int n = m->motion_count;
    return (m->parameters = COPY(v, m->parameters, m->parameter_count, more)) &&
           (m->motions = COPY(v, m->motions, n, 0)) && (m->bodies = COPY(v, m->bodies, m->body_count, 0)) &&
           (m->points = COPY(v, m->points, m->point_count, 0)) && (m->forces = COPY(v, m->forces, m->force_count, 0)) &&
           (m->wheels = COPY(v, m->wheels, m->wheel_count, 0)) && copy_closures(v) &&
           (m->start.q = COPY(v, m->start.q, n, 0)) && (m->start.qd = COPY(v, m->start.qd, n, 0)) &&
           (m->start.q_given = COPY(v, m->start.q_given, n, 0)) &&
           (m->start.qd_given = COPY(v, m->start.qd_given, n, 0)) &&
           (m->start.goals = COPY(v, m->start.goals, m->start.goal_count, 0));
}

/* -- variable parameters ----------------------------------------------------------------------------- */

static int find_motion(const kempe_model *m, const char *name)
{
    for (int k = 0; k < m->motion_count; k++)
        if (strcmp(m->motions[k].name, name) == 0)
            return k;
    return -1;
}

int kmp_parameter_find(const kempe_model *model, const char *name)
{
    for (int k = 0; k < model->parameter_count; k++)
        if (strcmp(model->parameters[k].name, name) == 0)
            return k;
    return -1;
}

/* A start value becomes a parameter of its column's name. -1: no memory. */
static int add_start(kmp_variant *v, const char *name, bool rate, int motion)
{
    kempe_model *m = &v->model;
    kmp_expr *e = KMP_ARENA_NEW(&m->arena, kmp_expr, 1);
    const char *kept = kmp_arena_strdup(&m->arena, name);
    kmp_number *number = rate ? &m->start.qd[motion] : &m->start.q[motion];
    if (!e || !kept)
        return -1;
    *e = (kmp_expr){.kind = KMP_EXPR_PARAMETER, .index = m->parameter_count};
    m->parameters[m->parameter_count] = (kmp_parameter){.name = kept, .number = {.value = number->value}};
    number->expr = e;
    (rate ? m->start.qd_given : m->start.q_given)[motion] = true;
    return m->parameter_count++;
}

static void say_unknown(const kempe_model *m, const char *name, bool coordinate, kmp_text *why)
{
    kmp_nearest nearest = kmp_nearest_begin(name);
    for (int k = 0; coordinate && k < m->motion_count; k++)
        kmp_nearest_offer(&nearest, m->motions[k].name);
    for (int k = 0; !coordinate && k < m->parameter_count; k++)
        kmp_nearest_offer(&nearest, m->parameters[k].name);
    kmp_text_printf(why, "the model has no %s '%s'", coordinate ? "coordinate" : "parameter", name);
    kmp_nearest_suggest(&nearest, why);
}

/* The meaning of a name: a parameter, or the coordinate whose start value or rate it is; the other is -1. */
typedef struct meaning {
    int parameter, motion;
    bool rate;
} meaning;

static meaning look_up(const kempe_model *m, const char *name)
{
    bool rate = strncmp(name, "qd.", 3) == 0, start = rate || strncmp(name, "q.", 2) == 0;
    meaning found = {kmp_parameter_find(m, name), -1, rate};
    if (found.parameter < 0 && start)
        found.motion = find_motion(m, name + (rate ? 3 : 2));
    return found;
}

bool kmp_variant_may(const kempe_model *m, const char *name, kmp_text *why)
{
    meaning found = look_up(m, name);
    bool start = strncmp(name, "qd.", 3) == 0 || strncmp(name, "q.", 2) == 0;
    if (found.parameter < 0 && found.motion < 0)
        say_unknown(m, start ? strchr(name, '.') + 1 : name, start, why);
    else if (found.parameter >= 0 && m->parameters[found.parameter].fixed)
        kmp_text_printf(why,
                        "parameter '%s' cannot be a variable of the equations: an axis, a table, a track, a power or a "
                        "setting of the run depends on it; use one model for each of its values",
                        name);
    return why->length == 0;
}

static kempe_status mark(kmp_variant *v, int k, const char *name)
{
    kempe_model *m = &v->model;
    kmp_text why = {0};
    if (!kmp_variant_may(m, name, &why)) {
        kempe_status status =
            why.failed ? kmp_fail_memory(m->context) : kmp_fail(m->context, KEMPE_E_ARGUMENT, "%s", why.s);
        kmp_text_free(&why);
        return status;
    }
    meaning found = look_up(m, name);
    int at = found.parameter >= 0 ? found.parameter : add_start(v, name, found.rate, found.motion);
    if (at < 0)
        return kmp_fail_memory(m->context);
    if (m->parameters[at].varies)
        return kmp_fail(m->context, KEMPE_E_ARGUMENT, "'%s' is given twice", name);
    m->parameters[at].varies = true;
    m->parameters[at].number.expr = NULL;
    v->parameter[k] = at;
    return KEMPE_OK;
}

static bool is_ready(const kempe_model *m, const bool *waits, const kmp_expr *e)
{
    if (!e)
        return true;
    if (e->kind == KMP_EXPR_PARAMETER)
        return !waits[e->index];
    return is_ready(m, waits, e->a) && is_ready(m, waits, e->b) && is_ready(m, waits, e->c);
}

/* Parameters that depend on variable ones vary too; finds their order, which has no cycle. */
static kempe_status find_order(kmp_variant *v, int count)
{
    kempe_model *m = &v->model;
    bool *asked = KMP_NEW(bool, m->parameter_count), grew = true;
    if (!asked)
        return kmp_fail_memory(m->context);
    for (int k = 0; k < count; k++)
        asked[v->parameter[k]] = true;
    while (grew) {
        grew = false;
        for (int k = 0; k < m->parameter_count; k++)
            if (!m->parameters[k].varies && kmp_expr_varies(m, m->parameters[k].number.expr))
                grew = m->parameters[k].varies = true;
    }
    for (int k = 0; k < m->parameter_count; k++)
        asked[k] = m->parameters[k].varies && !asked[k]; /* now: waits for others */
    for (grew = true; grew;) {
        grew = false;
        for (int k = 0; k < m->parameter_count; k++)
            if (asked[k] && is_ready(m, asked, m->parameters[k].number.expr)) {
                asked[k] = false;
                m->led[m->led_count++] = k;
                grew = true;
            }
    }
    kmp_free(asked);
    return KEMPE_OK;
}

/* -- dependent numbers ------------------------------------------------------------------------------- */

static bool follow_by(kmp_variant *v, kmp_number *number, const kmp_expr *expr)
{
    if (!kmp_expr_varies(&v->model, expr ? expr : number->expr))
        return true;
    if (v->follower_count == v->follower_room) {
        int room = 2 * v->follower_room + 64;
        follower *grown = kmp_realloc(v->followers, (size_t)room, sizeof *grown);
        if (!grown)
            return false;
        v->followers = grown;
        v->follower_room = room;
    }
    v->followers[v->follower_count++] = (follower){number, expr};
    return true;
}

static bool follow(kmp_variant *v, int count, kmp_number *number)
{
    bool ok = true;
    for (int k = 0; ok && k < count; k++)
        ok = follow_by(v, &number[k], NULL);
    return ok;
}

static bool follow_closure(kmp_variant *v, kmp_closure *c)
{
    bool ok = follow(v, 1, &c->length);
    if (ok && c->function && c->length.value > 0) /* a rod's at t = 0 */
        ok = follow_by(v, &c->length, c->function);
    for (int k = 0; ok && k < c->term_count; k++)
        ok = follow(v, 1, &c->terms[k].factor);
    return ok && (!c->constant || follow(v, 1, (kmp_number *)c->constant)); /* its own copy */
}

static bool follow_wheel(kmp_variant *v, kmp_wheel *w)
{
    return follow(v, 1, &w->radius) && follow(v, 1, &w->shear_modulus) && follow(v, 1, &w->friction) &&
           follow(v, 1, &w->stiffness) && follow(v, 1, &w->damping) && follow(v, 1, &w->speed);
}

static bool find_followers(kmp_variant *v)
{
    kempe_model *m = &v->model;
    bool ok =
        follow(v, 3, m->gravity) && follow(v, m->motion_count, m->start.q) && follow(v, m->motion_count, m->start.qd);
    for (int k = 0; ok && k < m->body_count; k++) {
        kmp_body *b = &m->bodies[k];
        ok = follow(v, 1, &b->pitch) && follow(v, 1, &b->mass) && follow(v, 3, b->com) && follow(v, 6, b->inertia);
    }
    for (int k = 0; ok && k < m->point_count; k++)
        ok = follow(v, 3, m->points[k].at);
    for (int k = 0; ok && k < m->closure_count; k++)
        ok = follow_closure(v, &m->closures[k]);
    for (int k = 0; ok && k < m->force_count; k++)
        for (int f = 0; ok && f < kmp_force_field_count; f++)
            if (kmp_force_fields[f].kind == m->forces[k].kind)
                ok = follow(v, kmp_force_fields[f].size, kmp_force_number(&m->forces[k], f));
    for (int k = 0; ok && k < m->wheel_count; k++)
        ok = follow_wheel(v, &m->wheels[k]);
    for (int k = 0; ok && k < m->start.goal_count; k++)
        ok = follow(v, 3, m->start.goals[k].value) && follow(v, 3, m->start.goals[k].weight);
    return ok;
}

/* -- construction ------------------------------------------------------------------------------------ */

static kempe_status make(kmp_variant *v, int count, const char *const *names)
{
    kempe_status status = KEMPE_OK;
    for (int k = 0; status == KEMPE_OK && k < count; k++)
        status = mark(v, k, names[k]);
    int parameters = v->model.parameter_count;
    v->model.led = KMP_ARENA_NEW(&v->model.arena, int, parameters);
    v->model.led_count = 0;
    v->values = KMP_NEW(double, parameters);
    if (status == KEMPE_OK && (!v->model.led || !v->values))
        return kmp_fail_memory(v->model.context);
    for (int k = 0; status == KEMPE_OK && k < parameters; k++)
        v->values[k] = v->model.parameters[k].number.value;
    if (status == KEMPE_OK)
        status = find_order(v, count);
    if (status == KEMPE_OK && !find_followers(v))
        status = kmp_fail_memory(v->model.context);
    return status;
}

kempe_status kmp_variant_new(const kempe_model *model, int count, const char *const *names, kmp_variant **variant)
{
    KMP_TRY(kmp_model_check_finished(model));
    kmp_variant *v = KMP_NEW(kmp_variant, 1);
    if (v) {
        v->base = model;
        v->count = count;
        v->parameter = KMP_NEW(int, count);
    }
    kempe_status status =
        v && v->parameter && copy_model(v, model, count) ? make(v, count, names) : kmp_fail_memory(model->context);
    if (status == KEMPE_OK)
        *variant = v;
    else
        kmp_variant_free(v);
    return status;
}

void kmp_variant_free(kmp_variant *v)
{
    if (!v)
        return;
    kmp_arena_free(&v->model.arena);
    kmp_free(v->parameter);
    kmp_free(v->values);
    kmp_free(v->followers);
    kmp_free(v);
}

kempe_model *kmp_variant_model(kmp_variant *variant)
{
    return &variant->model;
}

/* -- values ------------------------------------------------------------------------------------------ */

static bool check_bodies(const kempe_model *m, const kempe_model *base, kmp_text *why)
{
    static const char *const entry[] = {"xx", "yy", "zz"};
    for (int k = 1; k < m->body_count; k++) {
        const kmp_body *b = &m->bodies[k];
        if (b->mass.value < 0) {
            kmp_text_printf(why, "the mass of body '%s' is negative: %.6g", b->name, b->mass.value);
            return false;
        }
        for (int i = 0; i < 3; i++)
            if (b->inertia[i].value < 0 && !(base->bodies[k].inertia[i].value < 0)) { /* as given, then */
                kmp_text_printf(why, "the inertia of body '%s' is impossible: %s = %.6g is negative", b->name, entry[i],
                                b->inertia[i].value);
                return false;
            }
    }
    return true;
}

static bool check_forces(const kempe_model *m, kmp_text *why)
{
    for (int k = 0; k < m->force_count; k++) {
        const kmp_force *force = &m->forces[k];
        for (int f = 0; f < kmp_force_field_count; f++) {
            const kmp_force_field *field = &kmp_force_fields[f];
            if (field->kind != force->kind || !kmp_force_has(force, f))
                continue;
            for (int i = 0; i < field->size; i++) {
                double x = kmp_force_get(force, f)[i].value;
                bool good =
                    field->rule == KMP_FIELD_ANY || x > 0 || (field->rule == KMP_FIELD_NOT_NEGATIVE && !(x < 0));
                if (!good) {
                    kmp_text_printf(why, "force '%s': %s is %.6g", force->name, field->key, x);
                    return false;
                }
            }
        }
        if (force->has_lower && force->has_upper && force->lower.value >= force->upper.value) {
            kmp_text_printf(why, "force '%s': lower is %.6g, which is not below upper, %.6g", force->name,
                            force->lower.value, force->upper.value);
            return false;
        }
    }
    return true;
}

static bool check_closures(const kempe_model *m, const kempe_model *base, kmp_text *why)
{
    for (int k = 0; k < m->closure_count; k++) {
        const kmp_closure *c = &m->closures[k];
        if (base->closures[k].length.value > 0 && strcmp(c->kind, "rod") == 0 && !(c->length.value > 0)) {
            kmp_text_printf(why, "the length of closure '%s' is %.6g: it must be positive", c->name, c->length.value);
            return false;
        }
        for (int i = 0; i < c->term_count; i++)
            if (c->terms[i].factor.value == 0) {
                kmp_text_printf(why, "closure '%s': the factor of '%s' is zero", c->name,
                                m->motions[c->terms[i].motion].name);
                return false;
            }
    }
    return true;
}

static bool check_goals(const kempe_model *m, kmp_text *why)
{
    for (int k = 0; k < m->start.goal_count; k++)
        for (int i = 0; i < m->start.goals[k].width; i++)
            if (m->start.goals[k].weight[i].value < 0) {
                kmp_text_printf(why, "the weight of a goal is %.6g: it must not be negative",
                                m->start.goals[k].weight[i].value);
                return false;
            }
    return true;
}

/* Checks that depend on values of the instance alone, not on single numbers. */
static bool set_values(kmp_variant *v, const double *values, kmp_text *why)
{
    kempe_model *m = &v->model;
    for (int k = 0; k < v->count; k++)
        v->values[v->parameter[k]] = values[k];
    for (int k = 0; k < m->led_count; k++)
        v->values[m->led[k]] = kmp_expr_value(m->parameters[m->led[k]].number.expr, v->values);
    for (int k = 0; k < m->parameter_count; k++) {
        m->parameters[k].number.value = v->values[k];
        if (!isfinite(v->values[k]) && !why->length)
            kmp_text_printf(why, "parameter '%s' is %s: a finite number is expected", m->parameters[k].name,
                            isnan(v->values[k]) ? "not a number" : "infinite");
    }
    for (int k = 0; k < v->follower_count; k++) {
        const follower *f = &v->followers[k];
        double x = kmp_expr_value_at(f->expr ? f->expr : f->number->expr, v->values, 0);
        f->number->value = x;
        if (!isfinite(x) && !why->length)
            kmp_text_put(why, "a number of the model is not finite with these parameters");
    }
    return why->length == 0;
}

kempe_status kmp_variant_set(kmp_variant *v, const double *values, kmp_text *why)
{
    const kempe_model *m = &v->model;
    bool good = set_values(v, values, why) && check_bodies(m, v->base, why) && check_forces(m, why) &&
                check_closures(m, v->base, why) && check_goals(m, why);
    return why->failed ? kmp_fail_memory(m->context) : good ? KEMPE_OK : KEMPE_E_INPUT;
}
