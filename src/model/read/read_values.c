/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers, vectors and the names that refer to bodies, points and motions. */
#include "model/read/read_values.h"
#include "linalg/dense/dot.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/data/rope.h"
#include "model/language/expression_dimension.h"
#include "model/language/expression_value.h"
#include "model/language/number_algebra.h"
#include "model/read/read_include.h"
#include "model/read/read_linkage.h"
#include "model/read/read_ports.h"
#include "model/read/read_states.h"
#include "model/read/reading.h"
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

/* -- symbols of expressions ------------------------------------------------------------------------ */

static int find_parameter(void *user, const char *name)
{
    kmp_reader *r = user;
    return kmp_name_find(KMP_NAMED(r->model, parameter), kmp_reader_name(r, r->scope, name));
}

static const kmp_body *find_joint(const kempe_model *model, const char *name)
{
    int body = kmp_joint_find(model, name);
    return body < 0 ? NULL : &model->bodies[body];
}

static bool is_number(const char *text, int number)
{
    char digits[16];
    snprintf(digits, sizeof digits, "%d", number);
    return strcmp(text, digits) == 0;
}

/* A coordinate by its name, by joint.k, or by the bare name of a joint with one motion: of one with several it would be
 * ambiguous. */
static int find_coordinate(void *user, const char *name)
{
    kmp_reader *r = user;
    const kempe_model *model = r->model;
    name = kmp_reader_name(r, r->scope, name);
    const int named = kmp_index_find(&r->motions, &r->scratch, KMP_COORDINATES(model), -1, 0, name);
    const int joint = named < 0 ? kmp_joint_find(model, name) : -1;
    const char *dot = strrchr(name, '.');
    if (named >= 0)
        return named;
    if (joint >= 0)
        return model->bodies[joint].motion_count == 1 ? model->bodies[joint].first_motion : -1;
    for (int i = 1; dot && i < model->body_count; i++) {
        const kmp_body *body = &model->bodies[i];
        if (strlen(body->joint) != (size_t)(dot - name) || strncmp(body->joint, name, (size_t)(dot - name)) != 0)
            continue;
        for (int k = body->first_motion; k < body->first_motion + body->motion_count; k++)
            if (is_number(dot + 1, model->motions[k].number))
                return k;
    }
    return -1;
}

/* A coordinate of a joint with a reported error may be replaced by any other. */
static int find_in_expression(void *user, const char *name)
{
    kmp_reader *r = user;
    int motion = find_coordinate(r, name);
    bool said = r->wrong && kmp_linkage_find(r, kmp_reader_name(r, r->scope, name)) == KMP_LINKED_CUT;
    return motion < 0 && said && r->model->motion_count > 0 ? 0 : motion;
}

static const kmp_expr *find_cut(void *user, const char *name)
{
    kmp_reader *r = user;
    int found = kmp_cut_coordinate_find(r->model, kmp_reader_name(r, r->scope, name));
    return found < 0 ? NULL : r->model->cut_coordinates[found].value;
}

static void suggest_coordinate(const kmp_reader *r, const char *name, kmp_text *sentence)
{
    const kmp_body *body = find_joint(r->model, name);
    if (body && body->motion_count > 1) {
        kmp_text_printf(sentence, "; joint '%s' has %d motions: %s.1 to %s.%d", name, body->motion_count, name, name,
                        body->motion_count);
        return;
    }
    kmp_nearest nearest = kmp_nearest_of(name, KMP_COORDINATES(r->model));
    kmp_nearest_suggest(&nearest, sentence);
}

static const kmp_named_table *find_table(void *user, const char *name)
{
    kmp_reader *r = user;
    int found = kmp_name_find(KMP_NAMED(r->model, table), kmp_reader_name(r, r->scope, name));
    return found < 0 ? NULL : &r->model->tables[found];
}

static bool find_input(void *user, const char *name, kmp_expr *made)
{
    kmp_reader *r = user;
    int found = kmp_name_find(KMP_NAMES(r->model->inputs, kmp_model_given_inputs(r->model)),
                              kmp_reader_name(r, r->scope, name));
    const kmp_model_input *input = found < 0 ? NULL : &r->model->inputs[found];
    if (input && input->signal.count > 0) /* the errors of others are reported */
        *made = (kmp_expr){.index = found, .unit = input->dimension, .value = kmp_signal_value(&input->signal, 0)};
    else if (input)
        *made = (kmp_expr){.index = found, .unit = KMP_DIM_ANY};
    return input;
}

/* The motion of a state; -1: there is none. */
static int find_state(void *user, const char *name)
{
    kmp_reader *r = user;
    int found = kmp_name_find(KMP_NAMED(r->model, state), kmp_reader_name(r, r->scope, name));
    return found < 0 ? -1 : kmp_model_coordinates(r->model) + found;
}

static int find_unknown(void *user, const char *name, const kmp_unknowns **unknowns, int *number)
{
    kmp_reader *r = user;
    const kempe_model *model = r->model;
    name = kmp_reader_name(r, r->scope, name);
    for (int i = 0; i < model->unknowns_count; i++) {
        const kmp_unknowns *u = *unknowns = &model->unknowns[i];
        *number = kmp_name_find(kmp_unknown_names(u), name);
        if (*number < 0)
            continue;
        kmp_read_block_of(r, i);
        return i;
    }
    return -1;
}

static void suggest_parameter(kmp_reader *r, const char *name, kmp_text *sentence)
{
    kmp_nearest nearest = kmp_nearest_begin(name);
    kmp_nearest_offer(&nearest, "pi");
    kmp_nearest_offer_all(&nearest, KMP_NAMED(r->model, parameter));
    kmp_nearest_offer_all(&nearest, KMP_NAMES(r->model->inputs, kmp_model_given_inputs(r->model)));
    kmp_nearest_offer_all(&nearest, KMP_NAMED(r->model, state));
    for (int i = 0; i < r->model->unknowns_count; i++)
        kmp_nearest_offer_all(&nearest, kmp_unknown_names(&r->model->unknowns[i]));
    if (kmp_yaml_get(kmp_yaml_get(r->root, "sensors"), kmp_reader_name(r, r->scope, name)))
        kmp_text_printf(
            sentence,
            "; '%s' is a sensor, and only outputs have sensors: as an entry of 'algebraic' every expression "
            "may have it",
            name);
    else if (!nearest.best && find_joint(r->model, name))
        kmp_text_printf(sentence, "; the coordinate of joint '%s' is q(%s)", name, name);
    else
        kmp_nearest_suggest(&nearest, sentence);
}

/* Drives among them. */
static int find_closure(void *user, const char *name)
{
    kmp_reader *r = user;
    return kmp_name_find(KMP_NAMED(r->model, closure), kmp_reader_name(r, r->scope, name));
}

static int find_gear(void *user, const char **name)
{
    const kempe_model *model = ((kmp_reader *)user)->model;
    const int found = find_closure(user, *name);
    if (found < 0 || model->closures[found].kind != KMP_CLOSURE_gear)
        return -1;
    *name = model->closures[found].name;
    return found;
}

static int find_rope(void *user, const char **name, int *places, int *closure)
{
    kmp_reader *r = user;
    const char *full = kmp_reader_name(r, r->scope, *name);
    const int found = kmp_name_find(KMP_NAMED(r->model, rope), full);
    if (found < 0)
        return -1;
    const kmp_rope *rope = &r->model->ropes[found];
    *name = rope->name;
    *places = rope->count;
    *closure = rope->kind == KMP_ROPE_LAW       ? -3
               : rope->kind == KMP_ROPE_ELASTIC ? -2
                                                : kmp_name_find(KMP_NAMED(r->model, closure), rope->name);
    return found;
}

static int find_carried(void *user, const char **name, const char **obstacle)
{
    kmp_reader *r = user;
    int body = kmp_joint_find(r->model, kmp_reader_name(r, r->scope, *name));
    *name = body < 0 ? *name : r->model->bodies[body].joint;
    *obstacle = body < 0 ? NULL : kmp_joint_obstacle(r->model, body);
    return body;
}

static int find_bearings(void *user, const char **name)
{
    kmp_reader *r = user;
    const int k = kmp_name_find(KMP_NAMED(r->model, bearing), kmp_reader_name(r, r->scope, *name));
    *name = k < 0 ? *name : r->model->bearings[k].name;
    return k;
}

static void suggest_closure(kmp_reader *r, const char *name, kmp_text *sentence)
{
    if (kmp_linkage_find(r, name) == KMP_LINKED_TREE || find_joint(r->model, name)) {
        kmp_text_printf(sentence,
                        "; joint '%s' is in the tree and has no multipliers; reaction(%s) and moment(%s) are its "
                        "load, and 'cut: yes' makes it a closure",
                        name, name, name);
        return;
    }
    kmp_nearest nearest = kmp_nearest_of(name, KMP_NAMED(r->model, closure));
    kmp_nearest_suggest(&nearest, sentence);
}

bool kmp_reader_measure_argument(kmp_reader *r, int point, int axis, kmp_measure_argument *argument)
{
    const kmp_point *p = &r->model->points[point];
    kmp_text name = {0};
    kmp_text_printf(&name, "%s.%s", r->model->bodies[p->body].name, p->name);
    *argument = (kmp_measure_argument){.point = point,
                                       .axis = axis,
                                       .frame = p->station > 0 ? 0 : 1 + p->body,
                                       .name = kmp_text_keep(&name, &r->model->arena)};
    return argument->name;
}

static bool find_argument(void *user, const char *text, const char *word, int column, kmp_measure_argument *argument)
{
    kmp_reader *r = user;
    int point = kmp_read_point_text(r, (kmp_place){r->scope_line, column, r->scope}, text, word);
    return point >= 0 && kmp_reader_measure_argument(r, point, -1, argument);
}

/* An expression may be read more than once. */
static void note_turns(void *user, const char *function, double value, int column)
{
    kmp_reader *r = user;
    const kmp_turns turns = {
        {r->scope_line, column, r->scope}, kmp_reader_say(r, "the argument of %s", function), value, true};
    bool known = false;
    for (int k = 0; k < r->turn_count; k++)
        known = known || memcmp(&r->turns[k].place, &turns.place, sizeof turns.place) == 0;
    if (!known && KMP_ARENA_GROW(&r->scratch, r->turns, r->turn_count))
        r->turns[r->turn_count++] = turns;
}

/* Contacts with a law are known before they are read. */
static const char *find_contact(void *user, const char *name)
{
    kmp_reader *r = user;
    const char *full = kmp_reader_name(r, r->scope, name);
    const kmp_yaml *contact = kmp_yaml_get(kmp_yaml_get(r->root, "contacts"), full);
    return kmp_yaml_get(contact, "law") || kmp_yaml_get(contact, "force") ? kmp_arena_strdup(&r->model->arena, full)
                                                                          : NULL;
}

static void suggest(void *user, const char *name, kmp_expr_symbol symbol, kmp_text *sentence)
{
    if (symbol == KMP_SYMBOL_COORDINATE)
        suggest_coordinate(user, name, sentence);
    else if (symbol == KMP_SYMBOL_CLOSURE)
        suggest_closure(user, name, sentence);
    else
        suggest_parameter(user, name, sentence);
}

static const kmp_expr *parse_unused(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_operands allowed)
{
    if (kmp_context_complaints(r->context) > KMP_MOST_COMPLAINTS) /* no further error would be kept */
        return NULL;
    if (node->kind != KMP_YAML_SCALAR || node->empty) {
        kmp_reader_complain(r, node->place, "%s must be a number or an expression, not %s", what,
                            node->empty                   ? "nothing"
                            : node->kind == KMP_YAML_LIST ? "a list"
                                                          : "a mapping");
        return NULL;
    }
    bool of_motion = allowed == KMP_OF_MOTION || allowed == KMP_COMPARISON,
         of_loads = of_motion || allowed == KMP_OF_LOADS,
         of_state = of_loads || allowed == KMP_OF_STATE || allowed == KMP_OF_NEXT;
    kmp_expr_scope scope = {.context = r->context,
                            .arena = &r->model->arena,
                            .file = r->model->source.files[node->text_place.file],
                            .line = node->text_place.line,
                            .column = node->text_place.column,
                            .user = r,
                            .parameter = find_parameter,
                            .coordinate = of_state ? find_in_expression : NULL,
                            .cut = of_state ? find_cut : NULL,
                            .point = of_state ? find_argument : NULL,
                            .closure = of_loads ? find_closure : NULL,
                            .joint = of_loads ? find_carried : NULL,
                            .gear = of_state ? find_gear : NULL,
                            .rope = of_state ? find_rope : NULL,
                            .accelerations = of_motion,
                            .bearing = of_motion ? find_bearings : NULL,
                            .jumps = allowed == KMP_OF_MOTION || allowed == KMP_OF_NEXT,
                            .input = find_input,
                            .state = find_state,
                            .table = find_table,
                            .unknown = find_unknown,
                            .contact = find_contact,
                            .locals = r->locals,
                            .suggest = suggest,
                            .incomplete = r->unread,
                            .time = allowed != KMP_OF_PARAMETERS,
                            .compares = allowed == KMP_COMPARISON,
                            .degrees = &r->model->source.degrees,
                            .turns = note_turns,
                            .place = allowed == KMP_OF_X       ? 1
                                     : allowed == KMP_OF_PLACE ? 3
                                                               : 0};
    r->scope = node->text_place.file;
    r->scope_line = node->text_place.line;
    const kmp_expr *expr = kmp_expr_parse(&scope, node->text);
    if (!expr)
        r->wrong = true;
    return expr;
}

static const kmp_expr *parse(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_operands allowed)
{
    const kmp_expr *expr = parse_unused(r, node, what, allowed);
    kmp_reader_use(r, expr);
    return expr;
}

/* -- numbers ------------------------------------------------------------------------------------- */

static bool is_bad_parameter(const kmp_expr *expr, const void *known)
{
    return expr->kind == KMP_EXPR_PARAMETER && !((const bool *)known)[expr->index];
}

static bool is_known(const kmp_reader *r, const kmp_expr *expr)
{
    return !kmp_expr_find(expr, is_bad_parameter, r->parameter_known);
}

bool kmp_check_finite(kmp_reader *r, const kmp_yaml *node, const char *what, double value)
{
    if (!isfinite(value))
        kmp_reader_complain(r, node->place, "%s is '%s', which is %s: a finite number is expected", what, node->text,
                            isnan(value) ? "not a number" : "infinite");
    return isfinite(value);
}

bool kmp_check_dimension(kmp_reader *r, const kmp_yaml *node, const char *what, const kmp_expr *expr,
                         kmp_dimension wanted, kmp_dimension *dimension)
{
    kmp_expr_fault fault = {0};
    kmp_text sentence = {0};
    kmp_place place = node->place;
    kmp_dimension found = kmp_expr_dimension(expr, r->parameter_dimensions, r->parameter_values, &fault);
    if (!fault.at && kmp_dimension_fits(found, wanted)) {
        *dimension = found;
        return true;
    }
    if (fault.at) {
        kmp_expr_print_fault(&sentence, &fault);
        place = (kmp_place){node->text_place.line, fault.at->column, node->text_place.file};
    } else {
        kmp_text_put(&sentence, "expected ");
        kmp_dimension_print(&sentence, wanted);
        kmp_text_put(&sentence, ", got ");
        kmp_dimension_print(&sentence, found);
        kmp_dimension_hint(&sentence, wanted, found);
    }
    return kmp_reader_complain(r, place, "%s: %s", what, kmp_reader_take(r, &sentence));
}

kmp_dimension kmp_motion_dimension(const kempe_model *model, int motion, double power)
{
    bool slides = motion >= 0 && !model->motions[motion].rotation;
    kmp_dimension dimension = KMP_DIM(slides ? 1 : 0, 0, power);
    dimension.angle = motion >= 0 && !slides;
    return dimension;
}

kmp_dimension kmp_effort_dimension(const kempe_model *model, int motion)
{
    return model->motions[motion].rotation ? KMP_DIM_TORQUE : KMP_DIM_FORCE;
}

const kmp_expr *kmp_read_constant(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    return parse_unused(r, node, what, KMP_OF_PARAMETERS);
}

/* A literal without a unit, or a parameter whose value is one. */
static bool is_bare(const kmp_reader *r, const kmp_expr *expr)
{
    const kmp_parameter *p = expr->kind == KMP_EXPR_PARAMETER ? &r->model->parameters[expr->index] : NULL;
    if (p)
        return p->dimension.kind == KMP_DIMENSION_BARE && !p->number.expr;
    const kmp_expr *literal = expr->kind == KMP_EXPR_NEG ? expr->a : expr;
    return literal->kind == KMP_EXPR_NUMBER && literal->unit.kind == KMP_DIMENSION_BARE;
}

bool kmp_is_bare(kmp_reader *r, const kmp_yaml *node)
{
    const kmp_expr *expr = node->kind == KMP_YAML_SCALAR && !node->empty ? kmp_read_constant(r, node, "") : NULL;
    return expr && is_bare(r, expr);
}

void kmp_warn_of_turns(kmp_reader *r)
{
    for (const kmp_turns *x = r->turns; x < r->turns + r->turn_count; x++)
        if (x->certain || r->model->source.degrees || fabs(x->value) >= KMP_MANY_TURNS)
            kmp_reader_warn(r, x->place,
                            "%s is %g without a unit and is taken in rad, %.3g turns: for degrees write '%g deg'",
                            x->what, x->value, fabs(x->value) / KMP_TURN, x->value);
}

kmp_number kmp_number_of(const kmp_expr *expr, double value)
{
    bool literal = expr->kind == KMP_EXPR_NUMBER || (expr->kind == KMP_EXPR_NEG && expr->a->kind == KMP_EXPR_NUMBER);
    return (kmp_number){.value = value, .expr = literal ? NULL : expr, .symbol = expr->symbol};
}

bool kmp_read_number(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted, kmp_number *number)
{
    const kmp_expr *expr = parse(r, node, what, KMP_OF_PARAMETERS);
    if (!expr || !is_known(r, expr))
        return false;
    double value = kmp_expr_value(expr, r->parameter_values);
    kmp_dimension dimension;
    if (!kmp_check_finite(r, node, what, value) || !kmp_check_dimension(r, node, what, expr, wanted, &dimension))
        return false;
    *number = kmp_number_of(expr, value);
    number->symbol = ++r->model->symbol_count;
    if (wanted.angle && !kmp_dimension_is_physical(wanted) && fabs(value) > KMP_MORE_TURN && is_bare(r, expr)) {
        const kmp_turns turns = {node->place, kmp_reader_say(r, "%s", what), value, false};
        if (KMP_ARENA_GROW(&r->scratch, r->turns, r->turn_count))
            r->turns[r->turn_count++] = turns;
    }
    return true;
}

bool kmp_read_vector(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted, kmp_number vector[3])
{
    kmp_number read[3];
    bool good = kmp_read_list(r, node, what, 3);
    for (int i = 0; i < 3 && node->kind == KMP_YAML_LIST && i < node->count; i++)
        if (!kmp_read_number(r, node->items[i], kmp_reader_say(r, "component %d of %s", i + 1, what), wanted, &read[i]))
            good = false;
    if (good)
        memcpy(vector, read, sizeof read);
    return good;
}

bool kmp_read_one_or_three(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted,
                           kmp_number numbers[3])
{
    if (node->kind == KMP_YAML_LIST)
        return kmp_read_vector(r, node, what, wanted, numbers);
    if (!kmp_read_number(r, node, what, wanted, numbers))
        return false;
    numbers[1] = numbers[2] = numbers[0];
    return true;
}

bool kmp_read_fixed(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted, double *value)
{
    kmp_number number;
    if (!kmp_read_number(r, node, what, wanted, &number))
        return false;
    kmp_reader_fix(r, &number);
    *value = number.value;
    return true;
}

bool kmp_read_quantity(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted, double si,
                       double *value)
{
    const kmp_expr *expr = parse(r, node, what, KMP_OF_PARAMETERS);
    kmp_dimension dimension = {0};
    if (!expr || !is_known(r, expr))
        return false;
    double x = kmp_expr_value(expr, r->parameter_values);
    if (!kmp_check_finite(r, node, what, x) || !kmp_check_dimension(r, node, what, expr, wanted, &dimension))
        return false;
    const kmp_number number = kmp_number_of(expr, x);
    kmp_reader_fix(r, &number);
    *value = dimension.kind == KMP_DIMENSION_BARE ? x * si : x;
    return true;
}

bool kmp_check_rule(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_field_rule rule, double value,
                    const char *hint)
{
    if (kmp_field_fits(rule, value))
        return true;
    return kmp_reader_complain(r, node->place, "%s is %.6g: it must %s%s", what, value, kmp_field_rule_words(rule),
                               hint);
}

bool kmp_read_ruled(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted, kmp_field_rule rule,
                    kmp_number *number)
{
    return kmp_read_number(r, node, what, wanted, number) && kmp_check_rule(r, node, what, rule, number->value, "");
}

bool kmp_read_fixed_ruled(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted,
                          kmp_field_rule rule, double *value)
{
    return kmp_read_fixed(r, node, what, wanted, value) && kmp_check_rule(r, node, what, rule, *value, "");
}

bool kmp_read_whole(kmp_reader *r, const kmp_yaml *node, const char *what, const char *verb, int least, double most,
                    double *value)
{
    if (!kmp_read_fixed(r, node, what, KMP_DIM_NUMBER, value))
        return false;
    const char *to =
        most < INFINITY ? kmp_reader_say(r, "from %d to %g", least, most) : kmp_reader_say(r, "of at least %d", least);
    return (*value >= least && *value <= most && *value == floor(*value)) ||
           kmp_reader_complain(r, node->place, "%s %s %.6g: a whole number %s is expected", what, verb, *value, to);
}

const kmp_expr *kmp_read_ruled_key(kmp_reader *r, const kmp_yaml *map, const char *what, const char *key, bool required,
                                   kmp_dimension wanted, kmp_field_rule rule)
{
    const kmp_yaml *node = required ? kmp_read_required(r, map, what, key) : kmp_yaml_get(map, key);
    kmp_number number;
    return node && kmp_read_ruled(r, node, kmp_reader_say(r, "the %s of %s", key, what), wanted, rule, &number)
               ? kmp_number_expr(&r->model->arena, number)
               : NULL;
}

/* Sets a flag of the parameters in an expression, `flag` is its place in them; names without it are put in front
 * of the list `first`, by numbers from 1. */
static int mark_own(kempe_model *model, const kmp_expr *expr, size_t flag, int first)
{
    if (!expr)
        return first;
    if (expr->kind == KMP_EXPR_INPUT)
        model->inputs[expr->index].used = true;
    if (expr->kind != KMP_EXPR_PARAMETER) {
        first = mark_own(model, expr->a, flag, first);
        first = mark_own(model, expr->b, flag, first);
        return mark_own(model, expr->c, flag, first);
    }
    bool *set = (bool *)((char *)&model->parameters[expr->index] + flag);
    if (*set)
        return first;
    *set = true;
    model->parameters[expr->index].marked_next = first;
    return expr->index + 1;
}

/* The same of the names that they depend on, however long the chain is. */
static void mark(kempe_model *model, const kmp_expr *expr, size_t flag)
{
    for (int first = mark_own(model, expr, flag, 0); first > 0;) {
        const kmp_parameter *parameter = &model->parameters[first - 1];
        first = mark_own(model, parameter->number.expr, flag, parameter->marked_next);
    }
}

void kmp_reader_use(kmp_reader *r, const kmp_expr *expr)
{
    mark(r->model, expr, offsetof(kmp_parameter, used));
}

void kmp_reader_fix_setting(kmp_reader *r, const kmp_number *number)
{
    mark(r->model, number->expr, offsetof(kmp_parameter, fixed));
}

void kmp_reader_fix(kmp_reader *r, const kmp_number *number)
{
    kmp_reader_fix_setting(r, number);
    mark(r->model, number->expr, offsetof(kmp_parameter, shapes));
}

/* A constant law is a number of the model. */
static const kmp_expr *name_constant(kmp_reader *r, const kmp_expr *expr)
{
    kmp_expr *named = kmp_expr_is_constant(expr) ? KMP_ARENA_NEW(&r->model->arena, kmp_expr, 1) : NULL;
    if (!named)
        return expr;
    *named = *expr;
    named->symbol = ++r->model->symbol_count;
    return named;
}

/* Constants must be finite, and known dimensions must fit. */
const kmp_expr *kmp_read_expr(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted,
                              kmp_operands allowed)
{
    kmp_dimension dimension;
    const kmp_expr *expr = parse(r, node, what, allowed);
    if (expr && kmp_expr_is_constant(expr) && is_known(r, expr) &&
        !kmp_check_finite(r, node, what, kmp_expr_value(expr, r->parameter_values)))
        return NULL;
    if (expr && is_known(r, expr) && !kmp_check_dimension(r, node, what, expr, wanted, &dimension))
        return NULL;
    return expr ? name_constant(r, expr) : NULL;
}

const kmp_expr *kmp_read_function(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted,
                                  double *first)
{
    kmp_dimension dimension;
    const kmp_expr *expr = parse(r, node, what, KMP_OF_TIME);
    if (!expr || !is_known(r, expr) || !kmp_check_dimension(r, node, what, expr, wanted, &dimension))
        return NULL;
    double value = kmp_expr_value_at(expr, r->parameter_values, 0);
    if (!kmp_check_finite(r, node, what, value))
        return NULL;
    *first = value;
    return name_constant(r, expr);
}

/* -- references ---------------------------------------------------------------------------------- */

static int find_point(kmp_reader *r, int body, const char *name)
{
    return kmp_index_find(&r->points, &r->scratch, KMP_NAMES(r->model->points, r->model->point_count),
                          offsetof(kmp_point, body), body, name);
}

static int find_body(kmp_reader *r, const char *name)
{
    return kmp_index_find(&r->bodies, &r->scratch, KMP_BODY_NAMES(r->model), -1, 0, name);
}

static void complain_body(kmp_reader *r, kmp_place place, const char *text, size_t length, const char *what)
{
    const char *name = kmp_reader_say(r, "%.*s", (int)length, text);
    kmp_nearest nearest = kmp_nearest_of(name, KMP_BODY_NAMES(r->model));
    if (find_body(r, name) >= 0) /* of the model, not of the file */
        kmp_reader_complain(r, place, "%s: unknown body '%s': an included file knows its own bodies and its 'ports'",
                            what, name);
    else
        kmp_reader_complain_unknown(r, place, &nearest, "%s: unknown body '%s'", what, name);
}

static void complain_point(kmp_reader *r, kmp_place place, int body, const char *name, const char *what)
{
    kmp_nearest nearest = kmp_nearest_begin(name);
    if (r->unread) /* with the point, perhaps */
        return;
    for (int i = 0; i < r->model->point_count; i++)
        if (r->model->points[i].body == body)
            kmp_nearest_offer(&nearest, r->model->points[i].name);
    kmp_reader_complain_near(r, place, &nearest, "%s: body '%s' has no point '%s'", what, r->model->bodies[body].name,
                             name);
}

int kmp_read_point_of(kmp_reader *r, kmp_place place, int body, const char *name, const char *what)
{
    int point = find_point(r, body, name);
    if (point < 0)
        complain_point(r, place, body, name, what);
    return point;
}

/* A text without a point. Only joints take a body for its origin. */
static void complain_form(kmp_reader *r, kmp_place place, const char *text, const char *what)
{
    const bool body = strcmp(text, "ground") == 0 || find_body(r, kmp_reader_body_name(r, place.file, text)) >= 0;
    kmp_reader_complain(r, place, "%s: a point is written BODY.POINT, not '%s'%s%s%s", what, text,
                        body ? "; its origin is a point where 'points' of '" : "", body ? text : "",
                        body ? "' lists one, as O: [0, 0, 0]" : "");
}

int kmp_read_point_text(kmp_reader *r, kmp_place place, const char *text, const char *what)
{
    const char *rest;
    const kmp_yaml *port = kmp_port_bound(r, place.file, text, &rest);
    if (port) {
        place = port->place;
        text = port->text;
    }
    const char *dot = strchr(text, '.');
    if (!dot || dot == text || !dot[1]) {
        complain_form(r, place, text, what);
        return -1;
    }
    size_t length = (size_t)(dot - text);
    const char *name = kmp_reader_body_name(r, place.file, kmp_reader_say(r, "%.*s", (int)length, text));
    int body = find_body(r, name);
    bool ground = length == strlen("ground") && strncmp(text, "ground", length) == 0;
    if (body < 0 && !ground) /* an included ground on no body is reported at its include */
        complain_body(r, place, text, length, what);
    if (body < 0)
        return -1;
    int point = find_point(r, body, ground ? kmp_reader_name(r, place.file, dot + 1) : dot + 1);
    if (point < 0)
        complain_point(r, place, body, dot + 1, what);
    return point;
}

int kmp_read_body(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    const char *text = kmp_read_word(r, node, what);
    const char *name = text ? kmp_reader_body_name(r, node->place.file, text) : NULL;
    int body = name ? find_body(r, name) : -1;
    if (text && body < 0)
        complain_body(r, node->place, text, strlen(text), what);
    return body;
}

int kmp_read_point(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    const char *text = kmp_read_word(r, node, what);
    return text ? kmp_read_point_text(r, node->place, text, what) : -1;
}

bool kmp_read_two_points(kmp_reader *r, const kmp_yaml *node, const char *what, int point[2])
{
    int read[2] = {-1, -1};
    bool good = kmp_read_list(r, node, what, 2);
    for (int i = 0; i < 2 && node->kind == KMP_YAML_LIST && i < node->count; i++)
        read[i] = kmp_read_point(r, node->items[i], what);
    if (!good || read[0] < 0 || read[1] < 0)
        return false;
    int body = r->model->points[read[0]].body;
    if (body == r->model->points[read[1]].body)
        return kmp_complain_of(r, node, what, "both points are on body '%s'", r->model->bodies[body].name);
    memcpy(point, read, sizeof read);
    return true;
}

int kmp_read_motion_text(kmp_reader *r, kmp_place place, const char *name, const char *what)
{
    r->scope = place.file;
    int motion = find_coordinate(r, name);
    if (motion < 0 && !(r->wrong && kmp_linkage_find(r, kmp_reader_name(r, place.file, name)) == KMP_LINKED_CUT)) {
        kmp_text rest = {0};
        const kmp_body *body = find_joint(r->model, name);
        if (r->unread)
            return -1;
        if (body && body->motion_count == 0) {
            kmp_reader_complain(r, place, "%s: joint '%s' is a weld and has no coordinate", what, name);
            return -1;
        }
        suggest_coordinate(r, name, &rest);
        kmp_reader_complain(r, place, "%s: unknown joint '%s'%s", what, name, kmp_reader_take(r, &rest));
    }
    return motion;
}

int kmp_read_motion(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    const char *name = kmp_read_word(r, node, what);
    return name ? kmp_read_motion_text(r, node->place, name, what) : -1;
}

/* -- axes and orientations --------------------------------------------------------------------------- */

/* Axes and orientations: unit vectors, and frames from one or two of them. */

/* x, y, z with or without a minus. */
static bool read_letter_axis(const char *text, double axis[3])
{
    double sign = text[0] == '-' ? -1 : 1;
    const char *letter = text + (text[0] == '-');
    if (letter[0] < 'x' || letter[0] > 'z' || letter[1] != '\0')
        return false;
    axis[0] = axis[1] = axis[2] = 0;
    axis[letter[0] - 'x'] = sign;
    return true;
}

/* Scaled by the largest component first, so that no square overflows or vanishes. */
static bool normalise(double axis[3])
{
    double largest = fmax(fabs(axis[0]), fmax(fabs(axis[1]), fabs(axis[2])));
    if (!(largest > 0))
        return false;
    for (int i = 0; i < 3; i++)
        axis[i] /= largest;
    double length = sqrt(kmp_dot3(axis, axis));
    for (int i = 0; i < 3; i++)
        axis[i] = axis[i] / length + 0.0; /* no negative zeros */
    return true;
}

bool kmp_read_axis(kmp_reader *r, const kmp_yaml *node, const char *what, double axis[3])
{
    kmp_number vector[3];
    if (node->kind != KMP_YAML_LIST) {
        if (node->kind == KMP_YAML_SCALAR && read_letter_axis(node->text, axis))
            return true;
        return kmp_complain_of(r, node, what, "an axis is x, y, z, -x, -y, -z or a list of three numbers%s%s%s",
                               node->text[0] ? ", not '" : "", node->text, node->text[0] ? "'" : "");
    }
    if (!kmp_read_vector(r, node, kmp_reader_say(r, "%s: the axis", what), KMP_DIM_ANY, vector))
        return false;
    for (int i = 0; i < 3; i++) {
        axis[i] = vector[i].value;
        kmp_reader_fix(r, &vector[i]);
    }
    if (normalise(axis))
        return true;
    return kmp_complain_of(r, node, what, "the axis has no direction: all its components are zero");
}

/* -- orientations -------------------------------------------------------------------------------- */

static void set_column(double m[3][3], int k, const double v[3])
{
    for (int i = 0; i < 3; i++)
        m[i][k] = v[i] + 0.0;
}

/* An axis that is nearer to the opposite one than that, in rad, is turned there by half a turn about the next one. */
#define OPPOSITE 1e-9

void kmp_complete_axes(int k, const double axis[3], double m[3][3])
{
    int i = (k + 1) % 3, j = (k + 2) % 3;
    double across = axis[i] * axis[i] + axis[j] * axis[j], along = fabs(axis[k]), u[3], w[3];
    bool opposite = axis[k] < 0 && across < OPPOSITE * OPPOSITE;
    /* Rodrigues' rotation of unit vector k to the axis maps unit vector i to u = i - c axis_i (k + axis), c = 1 / (1 +
     * axis_k), here without a difference of nearly equal numbers. If `opposite`, it is the rotation of -k to the axis.
     */
    double c = axis[k] < 0 && !opposite ? (1 + along) / across : 1 / (1 + along);
    u[k] = opposite ? axis[i] : -axis[i];
    u[i] = 1 - c * axis[i] * axis[i];
    u[j] = -c * axis[i] * axis[j];
    kmp_cross3(axis, u, w);
    set_column(m, k, axis);
    set_column(m, i, u);
    set_column(m, j, w);
}

bool kmp_square_axes(int k, const double first[3], int l, const double second[3], double m[3][3])
{
    double along = kmp_dot3(first, second), v[3], w[3];
    for (int i = 0; i < 3; i++)
        v[i] = second[i] - along * first[i];
    double length = sqrt(kmp_dot3(v, v));
    if (k == l || !(length > 1e-6))
        return false;
    for (int i = 0; i < 3; i++)
        v[i] /= length;
    bool forward = l == (k + 1) % 3;
    kmp_cross3(forward ? first : v, forward ? v : first, w);
    set_column(m, k, first);
    set_column(m, l, v);
    set_column(m, 3 - k - l, w);
    return true;
}

static const kmp_key axes_keys[] = {{"x", "", ""}, {"y", "", ""}, {"z", "", ""}, {0}};

bool kmp_read_axes(kmp_reader *r, const kmp_yaml *node, const char *what, double m[3][3])
{
    double axis[2][3] = {{0}};
    int number[2] = {0};
    if (node->kind != KMP_YAML_MAP || node->count < 1 || node->count > 2)
        return kmp_complain_of(r, node, what, "axes are given by one or two of x, y, z, such as {z: [0, 1, 1]}");
    if (!kmp_read_map(r, node, what, axes_keys))
        return false;
    for (int k = 0; k < node->count; k++) {
        number[k] = node->keys[k]->text[0] - 'x';
        if (number[k] < 0 || number[k] > 2 || node->keys[k]->text[1] ||
            !kmp_read_axis(r, node->items[k], what, axis[k]))
            return false;
    }
    if (node->count == 1) {
        kmp_complete_axes(number[0], axis[0], m);
        return true;
    }
    if (kmp_square_axes(number[0], axis[0], number[1], axis[1], m))
        return true;
    return kmp_complain_of(r, node, what, "the two axes have the same direction");
}
