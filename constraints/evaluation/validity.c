/* SPDX-License-Identifier: BSD-3-Clause */
/* Results say what makes a state doubtful. Values beyond the first or last point of a table are extrapolated, which a
 * result must admit. Laws and closures have a condition for each end of a table; outputs have the argument of each use
 * among their values. A table is doubted once for an evaluator. So is friction whose level is negative. */
#include "constraints/evaluation/validity.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "dynamics/kinematics/kinematics_conditions.h"
#include "model/data/flexible.h"
#include "model/data/force.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/flexible/body_spectrum.h"
#include "model/language/expression_value.h"
#include <math.h>
#include <string.h>

struct kmp_validity_marks {
    bool *reported; /* of each table of the model: it has been doubted */
    bool *said;     /* of each condition of another kind, likewise */
    double *change; /* of each condition at the last kmp_eval_validity */
};

kmp_validity_marks *kmp_validity_marks_new(const kempe_system *system, kmp_arena *arena)
{
    kmp_validity_marks *left = KMP_ARENA_NEW(arena, kmp_validity_marks, 1);
    return left && KMP_ARENA_MAKE(arena, KMP_ROOM(bool, system->model->table_count, &left->reported),
                                  KMP_ROOM(bool, system->events.count, &left->said),
                                  KMP_ROOM(double, system->events.count, &left->change))
               ? left
               : NULL;
}

const char *kmp_table_advice(const kmp_named_table *table)
{
    return table->outside == KMP_OUTSIDE_ERROR ? "give it more points; 'outside: error' ends a run where forces and "
                                                 "constraints use the table, not sensors"
                                               : "give it more points, or say outside: linear, hold or error";
}

void kmp_doubt_table(kempe_context *context, const kmp_named_table *table, int end, double x, double t)
{
    kmp_doubt(context, KMP_TABLE_LEFT, table->name, x, kmp_table_end(table, end - end % 2),
              kmp_table_end(table, end - end % 2 + 1), t, kmp_table_advice(table));
}

void kmp_eval_report_table(kmp_evaluator *eval, const kmp_named_table *table, int end, double x, double t)
{
    bool *reported = &eval->validity->reported[table - eval->system->model->tables];
    if (!*reported)
        kmp_doubt_table(eval->system->context, table, end, x, t);
    *reported = true;
}

int kmp_eval_left(const kempe_system *s, const double *shown, int k, double *x)
{
    const kmp_named_table *table = &s->model->tables[s->use[k].table];
    const int first = 2 * s->use[k].variable;
    *x = shown[kmp_outputs_width(s->model) + k];
    return *x < kmp_table_end(table, first) ? first : *x > kmp_table_end(table, first + 1) ? first + 1 : -1;
}

void kmp_eval_report_tables(kmp_evaluator *eval, double t, const double *shown)
{
    for (int k = 0; k < eval->system->use_count; k++) {
        double x;
        int end = kmp_eval_left(eval->system, shown, k, &x);
        if (end >= 0)
            kmp_eval_report_table(eval, &eval->system->model->tables[eval->system->use[k].table], end, x, t);
    }
}

bool kmp_eval_validity(kmp_evaluator *eval, double t, const double *q, const double *qd, const double *qdd,
                       const double *lambda)
{
    const kmp_events *events = &eval->system->events;
    for (int k = 0; k < events->count; k++)
        if (events->condition[k].validity != KMP_VALIDITY_NONE) {
            if (qdd)
                kmp_eval_all_changes(eval, t, q, qd, qdd, lambda, eval->validity->change);
            else
                memcpy(eval->validity->change, kmp_eval_changes(eval, t, q, qd),
                       (size_t)events->count * sizeof(double));
            return true;
        }
    return false;
}

int kmp_eval_next_invalid(const kmp_evaluator *eval, int *from)
{
    const kmp_events *events = &eval->system->events;
    const double *change = eval->validity->change;
    for (; *from < events->count; ++*from)
        if (events->condition[*from].validity != KMP_VALIDITY_DEFLECTION &&
            kmp_condition_invalid(&events->condition[*from], change[*from], fabs(change[*from])))
            return (*from)++;
    return -1;
}

void kmp_eval_report_invalid(kmp_evaluator *eval, int k, double t)
{
    const kmp_condition *condition = &eval->system->events.condition[k];
    const double value = eval->validity->change[k];
    double x;
    if (condition->validity == KMP_VALIDITY_TABLE) {
        const int end = kmp_validity_end(condition, value, &x);
        kmp_eval_report_table(eval, condition->expr->table, end, x, t);
        return;
    }
    bool said = false;
    for (int i = 0; i < eval->system->events.count; i++)
        said = said || (eval->validity->said[i] && kmp_validities_equal(&eval->system->events.condition[i], condition));
    eval->validity->said[k] = true;
    if (!said)
        kmp_doubt_condition(eval->system, condition, value, t);
}

/* The rate of a flexible body at this value of its condition, and its first frequency. */
static double rate_at(const kmp_flexible *f, double value, double *first)
{
    kmp_flexible_spectrum own;
    const double rate = kmp_flexible_fastest(f) * sqrt(1 - value);
    *first = kmp_flexible_spectrum_find(f, &own) ? own.fixed[0] : rate;
    return rate;
}

static const char *rotation_advice(const kmp_flexible *f)
{
    return f->file ? "write terms of second order into its file" : "take stiffening 'first' or 'full'";
}

static void doubt_rotation(const kempe_system *s, const kmp_flexible *f, double value)
{
    const char *name = s->model->bodies[f->body].name;
    double first, rate = rate_at(f, value, &first);
    if (rate > first || !f->averaged)
        kmp_doubt(s->context, KMP_TURNS_FASTER, name, rate, first, rotation_advice(f));
    else
        kmp_doubt(s->context, KMP_TURNS_AVERAGED, name, rate, rate / first, f->doubt, KMP_ROTATION_AVERAGED);
}

static void put_rotation(const kempe_system *s, const kmp_flexible *f, double value, kmp_text *text)
{
    const char *name = s->model->bodies[f->body].name;
    double first, rate = rate_at(f, value, &first);
    if (rate > first || !f->averaged)
        kmp_text_printf(text, KMP_TURNS_FASTER, name, rate, first, rotation_advice(f));
    else
        kmp_text_printf(text, KMP_TURNS_AVERAGED, name, rate, rate / first, f->doubt, KMP_ROTATION_AVERAGED);
}

void kmp_eval_put_invalid(const kmp_evaluator *eval, int k, double t, kmp_text *text)
{
    const kmp_condition *condition = &eval->system->events.condition[k];
    const double value = eval->validity->change[k];
    double x;
    if (condition->validity == KMP_VALIDITY_TABLE) {
        const kmp_named_table *table = condition->expr->table;
        const int end = kmp_validity_end(condition, value, &x);
        kmp_text_printf(text, KMP_TABLE_LEFT, table->name, x, kmp_table_end(table, end & ~1),
                        kmp_table_end(table, end | 1), t, kmp_table_advice(table));
    } else if (condition->validity == KMP_VALIDITY_ROTATION) {
        put_rotation(eval->system, condition->of, value, text);
    } else {
        kmp_text_printf(text, KMP_LEVEL_PUSHES, ((const kmp_force *)condition->of)->name, value, t);
    }
}

/* -- conditions ----------------------------------------------------------------------------------------- */

bool kmp_condition_invalid(const kmp_condition *condition, double value, double largest)
{
    return condition->validity != KMP_VALIDITY_NONE &&
           value < (condition->validity == KMP_VALIDITY_LEVEL ? -KMP_LEVEL_ROUNDING * largest : 0);
}

bool kmp_validities_equal(const kmp_condition *a, const kmp_condition *b)
{
    return a->validity == b->validity &&
           (a->validity == KMP_VALIDITY_TABLE ? a->expr->table == b->expr->table : a->of == b->of);
}

int kmp_validity_end(const kmp_condition *condition, double value, double *x)
{
    const kmp_named_table *table = condition->expr->table;
    const int end = condition->number - kmp_table_end_number(table, 0);
    *x = kmp_table_end(table, end) + (end % 2 ? -value : value);
    return end;
}

static void doubt_deflection(const kempe_system *s, const kmp_flexible *f, double value, double t)
{
    const double length = kmp_number_at(f->length, s->parameters);
    kmp_doubt(
        s->context,
        "flexible body '%s' deflects by %.3g m at t = %.6g s, more than %.1f of its length; terms of second order "
        "suffice up to there: divide it into %s",
        s->model->bodies[f->body].name, KMP_DEFLECTION_LARGE * length * sqrt(1 - value), t, KMP_DEFLECTION_LARGE,
        kmp_flexible_parts(f));
}

void kmp_doubt_condition(const kempe_system *system, const kmp_condition *condition, double value, double t)
{
    double x;
    int end;
    switch (condition->validity) {
    case KMP_VALIDITY_TABLE:
        end = kmp_validity_end(condition, value, &x);
        kmp_doubt_table(system->context, condition->expr->table, end, x, t);
        break;
    case KMP_VALIDITY_LEVEL:
        kmp_doubt(system->context, KMP_LEVEL_PUSHES, ((const kmp_force *)condition->of)->name, value, t);
        break;
    case KMP_VALIDITY_DEFLECTION:
        doubt_deflection(system, condition->of, value, t);
        break;
    case KMP_VALIDITY_ROTATION:
        doubt_rotation(system, condition->of, value);
        break;
    default:
        break;
    }
}
