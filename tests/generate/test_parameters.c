/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow not_sanitized 2 */
/* Numbers kept as symbols: with other values in p the equations are those of a model that has these values, whichever
 * number of it they are of. Numbers that p does not have are reported. */
#include "backend/machine.h"
#include "base/memory.h"
#include "exchange/code/source.h"
#include "generate/models.h"
#include "model/data/compliant.h"
#include "model/data/force_table.h"
#include "model/data/gear.h"
#include "model/data/model.h"
#include "model/data/numbers.h"
#include "model/data/rope.h"
#include "model/data/tyre.h"
#include "model/flexible/beam.h"
#include "model/language/expression_value.h"
#include "testing.h"
#include "unit/random.h"
#include <kempe/generate.h>
#include <kempe/settings.h>
#include <math.h>

enum { MOST = 512 };

#define SETS "M+C+h+J+h_t+jdqd+invdyn"

static kempe_context *context;
static char warnings[4000];

static void on_log(void *user, kempe_level level, const char *line)
{
    (void)user;
    if (level == KEMPE_LOG_WARNING)
        (void)snprintf(warnings + strlen(warnings), sizeof warnings - strlen(warnings), "%s\n", line);
}

/* -- values ------------------------------------------------------------------------------------------ */

/* A factor for each name: small enough that no sign, no order and no square root is lost. */
static double factor(const char *name)
{
    unsigned sum = 0;
    for (; *name; name++)
        sum = 31 * sum + (unsigned char)*name;
    return 1 + 0.001 * (1 + sum % 17);
}

typedef struct state {
    double t, q[MOST], qd[MOST], qdd[MOST];
} state;

static state random_values(void)
{
    state s = {.t = 0.3};
    random_seed(11);
    for (int k = 0; k < MOST; k++) {
        s.q[k] = between(-1, 1);
        s.qd[k] = between(-2, 2);
        s.qdd[k] = between(-5, 5);
    }
    return s;
}

/* The routine at one state; `changed`: with other values in p. Returns the number of values; they are put into *out, to
 * be freed. */
static int evaluate(const kmp_code_source *source, bool changed, double **out)
{
    const kmp_code_routine *r = &source->routines[0];
    const kmp_program *program = r->program;
    state s = random_values();
    double *symbols = KMP_NEW(double, source->symbol_count + 1);
    kmp_machine *machine = kmp_machine_new(program, kmp_backend_find("tape"));
    int count = program->outputs[2] - program->outputs[1];
    for (int k = 0; k < source->symbol_count; k++)
        if (source->place[k] >= 0) {
            const char *name = source->parameter_name[source->place[k]];
            symbols[k] = source->value[source->place[k]] * (changed ? factor(name) : 1);
        }
    kmp_machine_set(machine, KMP_IN_PARAMETER, symbols);
    kmp_machine_set(machine, KMP_IN_TIME, &s.t);
    kmp_machine_set(machine, KMP_IN_Q, s.q);
    kmp_machine_set(machine, KMP_IN_QD, s.qd);
    kmp_machine_set(machine, KMP_IN_QDD, s.qdd);
    (void)kmp_machine_run(machine, 0);
    const double *values = kmp_machine_run(machine, 1);
    *out = KMP_NEW(double, count + 1);
    memcpy(*out, values, (size_t)count * sizeof **out);
    kmp_machine_free(machine);
    kmp_free(symbols);
    return count;
}

/* -- a model with other numbers ----------------------------------------------------------------------- */

/* True if an entry of p that is a parameter decides an expression. */
static bool follows(const kmp_code_source *source, const kmp_expr *e)
{
    if (e && e->kind == KMP_EXPR_PARAMETER)
        return source->place[e->index] >= 0 || follows(source, source->model->parameters[e->index].number.expr);
    return e && (follows(source, e->a) || follows(source, e->b) || follows(source, e->c));
}

/* The place of a symbol in p; -1: p does not have it. */
static int place_of(const kmp_code_source *source, int symbol)
{
    int k = symbol > 0 ? source->model->parameter_count + symbol - 1 : -1;
    return k >= 0 && k < source->symbol_count ? source->place[k] : -1;
}

static const char *name_of(const kmp_code_source *source, int symbol)
{
    int place = place_of(source, symbol);
    return place >= 0 ? source->parameter_name[place] : NULL;
}

/* The value of an expression of parameters alone. */
static double value_of(const kempe_model *model, const kmp_expr *e)
{
    static double values[MOST];
    for (int k = 0; k < model->parameter_count; k++)
        values[k] = model->parameters[k].number.value;
    return kmp_expr_value(e, values);
}

/* An included model stands off from its ground: a sum, whose numbers keep their names. */
static double changed_sum(const kmp_code_source *kept, const kempe_model *model, const kmp_expr *e)
{
    const char *name = name_of(kept, e->symbol);
    if (e->kind == KMP_EXPR_ADD)
        return changed_sum(kept, model, e->a) + changed_sum(kept, model, e->b);
    return value_of(model, e) * (e->kind == KMP_EXPR_NUMBER && name ? factor(name) : 1);
}

/* One that follows from parameters has changed with them; one that no routine needs may change as it likes. */
static void change(const kmp_code_source *kept, const kempe_model *model, const kmp_number *number)
{
    kmp_number *own = (kmp_number *)(uintptr_t)number;
    const char *name = name_of(kept, number->symbol);
    if (number->value == 0)
        return;
    if (follows(kept, number->expr))
        own->value = changed_sum(kept, model, number->expr);
    else
        own->value *= name ? factor(name) : 1.0625;
    own->expr = NULL;
}

static void change_vector(const kmp_code_source *kept, const kempe_model *model, const kmp_number number[3])
{
    for (int k = 0; k < 3; k++)
        change(kept, model, &number[k]);
}

static void change_law(const kmp_code_source *kept, const kmp_expr *law)
{
    kmp_expr *own = (kmp_expr *)(uintptr_t)law;
    const char *name = law ? name_of(kept, law->symbol) : NULL;
    if (!law || !kmp_expr_is_constant(law) || follows(kept, law))
        return;
    const double value = name ? kept->value[place_of(kept, law->symbol)] : value_of(kept->model, law);
    *own = (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = value * (name ? factor(name) : 1.0625)};
}

/* Changes the numbers inside a law of contact, each once, though the law may share them. */
static void change_inside(const kmp_code_source *kept, const kmp_expr *law)
{
    kmp_expr *own = (kmp_expr *)(uintptr_t)law;
    if (!law)
        return;
    if (law->kind == KMP_EXPR_NUMBER && name_of(kept, law->symbol))
        *own = (kmp_expr){.kind = KMP_EXPR_NUMBER, .value = law->value * factor(name_of(kept, law->symbol))};
    change_inside(kept, law->a);
    change_inside(kept, law->b);
    change_inside(kept, law->c);
}

static void change_closure(const kmp_code_source *kept, const kempe_model *model, const kmp_closure *closure)
{
    change(kept, model, &closure->number);
    if (closure->constant)
        change(kept, model, closure->constant);
    for (int k = 0; k < closure->term_count; k++)
        change(kept, model, &closure->terms[k].factor);
    change_law(kept, closure->function);
    for (int k = 0; k < closure->curve_count; k++)
        change_law(kept, closure->curve[k]);
    for (int k = 0; closure->gear && k < KMP_GEAR_NUMBERS; k++)
        change(kept, model, &closure->gear->number[k]);
}

static void change_rope(const kmp_code_source *kept, const kempe_model *model, const kmp_rope *rope)
{
    for (int k = 0; k < rope->count; k++)
        change(kept, model, &rope->places[k].radius);
    change(kept, model, &rope->stiffness);
    change(kept, model, &rope->preload);
    change_law(kept, rope->length);
}

static void change_force(const kmp_code_source *kept, const kempe_model *model, const kmp_force *force)
{
    for (int k = 0; k < kmp_force_field_count; k++)
        for (int i = 0; kmp_force_fields[k].kind == force->kind && i < kmp_force_fields[k].size; i++)
            change(kept, model, kmp_force_get(force, k) + i);
    change_law(kept, force->effort);
    change_law(kept, force->holding_effort);
    change_law(kept, force->touch.gap);
    if (force->compliant) {
        change_inside(kept, force->effort);
        change_inside(kept, force->touch.gap);
        for (int k = 0; k < 3; k++)
            change_inside(kept, force->vector[k]);
        const kmp_film *film = force->compliant->film;
        if (film) {
            change_inside(kept, film->scale);
            change_inside(kept, film->drag);
            change_inside(kept, film->most);
        }
        change_law(kept, force->compliant->clearance);
        change_law(kept, force->compliant->radius);
        change_law(kept, force->compliant->speed);
    }
    for (int k = 0; k < 3; k++)
        change_law(kept, force->vector[k]);
}

/* All that the equations are made of. */
static void change_model(const kmp_code_source *kept, const kempe_model *model)
{
    change_vector(kept, model, model->gravity);
    for (int b = 1; b < model->body_count; b++) {
        change(kept, model, &model->bodies[b].armature);
        change(kept, model, &model->bodies[b].mass);
        change_vector(kept, model, model->bodies[b].com);
        for (int k = 0; k < 6; k++)
            change(kept, model, &model->bodies[b].inertia[k]);
    }
    for (int k = 0; k < model->point_count; k++)
        change_vector(kept, model, model->points[k].at);
    for (int k = 0; k < model->closure_count; k++)
        change_closure(kept, model, &model->closures[k]);
    for (int k = 0; k < model->rope_count; k++)
        change_rope(kept, model, &model->ropes[k]);
    for (int k = 0; k < model->force_count; k++)
        change_force(kept, model, &model->forces[k]);
    for (int k = 0; k < model->road_count; k++)
        change(kept, model, &model->roads[k].friction);
    for (int k = 0; k < model->tyre_count; k++)
        for (int f = 0; f < KMP_TYRE_FIELDS; f++)
            change(kept, model, kmp_tyre_get(&model->tyres[k], f));
    for (int k = 0; k < model->motion_count; k++)
        change(kept, model, &model->start.q[k]);
    for (int k = 0; k < model->unknowns_count; k++)
        if (model->unknowns[k].count == 0)
            change_law(kept, model->unknowns[k].zero[0]);
}

/* Entries of p that are parameters, as settings. */
static int set_entries(const kmp_code_source *source, kempe_setting *settings, char (*texts)[40])
{
    int count = 0;
    for (int k = 0; k < source->model->parameter_count; k++)
        if (k < source->symbol_count && source->place[k] >= 0 && count < MOST) {
            const char *name = source->parameter_name[source->place[k]];
            (void)snprintf(texts[count], sizeof *texts, "%.17g", source->value[source->place[k]] * factor(name));
            settings[count] = (kempe_setting){source->model->parameters[k].name, texts[count]};
            count++;
        }
    return count;
}

/* -- trials ------------------------------------------------------------------------------------------ */

static void compare(const kmp_code_source *kept, const kmp_code_source *made, const char *what)
{
    double *with_p = NULL, *anew = NULL, largest = 1;
    int count = evaluate(kept, true, &with_p), wrong = 0;
    CHECK(evaluate(made, false, &anew) == count);
    for (int k = 0; k < count; k++)
        largest = isfinite(anew[k]) ? fmax(largest, fabs(anew[k])) : largest;
    for (int k = 0; k < count; k++)
        wrong += isfinite(anew[k]) && !(fabs(with_p[k] - anew[k]) <= 1e-9 * largest);
    if (wrong)
        printf("%s: %d of %d values are not those of the model with these numbers\n", what, wrong, count);
    CHECK(wrong == 0);
    kmp_free(with_p);
    kmp_free(anew);
}

static bool can_be_written(const kempe_model *model)
{
    kempe_code *code = NULL;
    bool can = kempe_code_new(model, &(kempe_generate_options){.sets = SETS, .language = "c", .keep_parameters = 1},
                              &code) == KEMPE_OK;
    kempe_code_free(code);
    return can;
}

/* Shapes in mean axes and ratios of damping are those of the nominal values (docs/model/flexible.md): a model that is
 * read with other values has others. */
static bool has_nominal_shapes(const kempe_model *model)
{
    for (int k = 0; k < model->flexible_count; k++) {
        const kmp_beam *beam = model->flexibles[k].beam;
        for (int f = 0; beam && f < KMP_BEAM_FAMILIES; f++)
            if (beam->stiffness[f].c[0].expr && (beam->frame == KMP_FRAME_MEAN || beam->ratio.value > 0))
                return true;
    }
    return false;
}

/* True if equations of the model can be written. `read` reads it with settings. */
static bool try_model(kempe_model *(*read)(const char *, const kempe_setting *, int), const char *what)
{
    static kempe_setting settings[MOST];
    static char texts[MOST][40];
    const kempe_generate_options g = {.sets = SETS, .drives = true, .keep_parameters = 1};
    kempe_model *model = read(what, NULL, 0), *other = NULL;
    kmp_code_source kept, made;
    if (model) /* the axes of a rounded drawing are moved, and no entries of p */
        CHECK(kempe_model_set_closure_tolerance(model, 0) == KEMPE_OK);
    if (!model || has_nominal_shapes(model) || !can_be_written(model) || model->motion_count > MOST ||
        kmp_source_init(&kept, model, &g) != KEMPE_OK) {
        kempe_model_free(model);
        return false;
    }
    other = read(what, settings, set_entries(&kept, settings, texts));
    CHECK(other != NULL);
    if (other) {
        change_model(&kept, other);
        CHECK(kempe_model_set_closure_tolerance(other, 0) == KEMPE_OK);
        CHECK(kmp_source_init(&made, other, &(kempe_generate_options){.sets = SETS, .drives = true}) == KEMPE_OK);
        compare(&kept, &made, what);
        kmp_source_free(&made);
    }
    kmp_source_free(&kept);
    kempe_model_free(model);
    kempe_model_free(other);
    return true;
}

static kempe_model *read_file(const char *path, const kempe_setting *settings, int count)
{
    kempe_model *model = NULL;
    return kempe_model_read_set(context, path, settings, count, &model) == KEMPE_OK ? model : NULL;
}

static kempe_model *read_text(const char *text, const kempe_setting *settings, int count)
{
    kempe_model *model = NULL;
    if (kempe_model_read_text_set(context, text, "text", settings, count, &model) == KEMPE_OK)
        return model;
    printf("%s\n", kempe_context_message(context));
    return NULL;
}

/* Numbers in every place, a few by parameters that follow from others, one exponent, an expression that is zero. */
static const char everywhere[] =
    "kempe: 1\ngravity: [0.1, -9.81, 0.2]\nparameters: {L: 0.7, half: L/2, a: 2, n: 3, two: 2*1.5, r: 0.4, s: 0.4}\n"
    "ground: {points: {O: [0.11, 0.12, 0.13], G: [0.3, 1.1, -0.2]}}\nbodies:\n"
    "  a: {joint: {revolute: [1, 2, 0.5], at: ground.O}, mass: 1/3, com: [half, 0.17, r - s],\n"
    "      inertia: {xx: 1.1, yy: 1.2, zz: 1.3, xy: 0.1, xz: 0.05, yz: 0.02}, points: {P: [L, 0.2, 0.1], "
    "U: [0.4, 0.1, 0.3]}}\n"
    "  b: {joint: {motions: [T1, -R2, R3], at: a.P, to: V}, mass: two, inertia: {xx: 1, yy: 1, zz: 1},\n"
    "      points: {Q: [0.1, 0.5, -0.3], V: [0.05, 0.06, 0.07]}}\n"
    "  c: {joint: {screw: z, pitch: 0.09, at: b.Q}, mass: 0.9, inertia: {zz: 0.2}, points: {W: [0.21, 0.22, 0.23]}}\n"
    "  w: {joint: {weld: yes, at: c.W, to: X}, mass: 0.31, com: [0.41, 0.42, 0.43], points: {X: [0.01, 0.02, 0.03]}}\n"
    "algebraic: {push: 1.7}\n"
    "loops:\n  R: {rod: [b.Q, ground.G], length: 1.3}\n  S: {rod: [w.X, ground.G], length: half + 0.9}\n"
    "  K: {coupler: {b.2: 1.5, b.3: -2.5}}\n  E: {coupler: {a: 1.4, b.2: 2.2}, equals: 0.6}\n"
    "  F: {point_on_curve: [ground.G, w.X], z: 0.37}\n  N: {constraint: \"q(a)^n - 0.01\", power: 0}\n"
    "drives: {D: {joint: b.1, displacement: 0.21}, k: {joint: b.3, locked: yes}}\n"
    "forces:\n  s: {spring: [b.Q, ground.G], stiffness: 20, damping: 0.7, free_length: 0.3}\n"
    "  u: {bushing: [a.U, b.Q], stiffness: 30, damping: [1, 2, 3], rotational_stiffness: 4, preload: [5, 6, 7]}\n"
    "  m: {joint: a, torque: 0.45}\n  o: {joint: a, torque: push}\n"
    "  e: {joint: a, stops: {lower: -0.2, upper: 0.3, stiffness: 9, damping: 2, width: 0.1}}\n"
    "  j: {joint: b.2, spring: {stiffness: 3, damping: 0.2, rest: 0.15}}\n"
    "  f: {joint: b.1, friction: {force: 0.8, speed: 0.05}}\n"
    "  p: {at: b.Q, force: [1.9, -2.1, a^1.5]}\n  t: {on: b, torque: [0, 0.33, \"a*t + q(a)^n\"]}\n"
    "start: {q: {b.2: 0.19, b.3: 0.29}}\n";

static void numbers_everywhere(void)
{
    CHECK(try_model(read_text, everywhere));
}

/* All of them, by the names that a reader of p looks for. */
static void names_of_all(void)
{
    static const char *const wanted[] = {"L",
                                         "a",
                                         "n",
                                         "r",
                                         "s",
                                         "two",
                                         "gravity.x",
                                         "a.mass",
                                         "a.com.y",
                                         "a.inertia.xy",
                                         "ground.G.y",
                                         "a.P.z",
                                         "b.V.x",
                                         "R.length",
                                         "K.b.3",
                                         "E.equals",
                                         "F.curve.1",
                                         "D.function",
                                         "start.q.b.3",
                                         "c.pitch",
                                         "s.free_length",
                                         "u.preload.z",
                                         "m.effort",
                                         "push.value",
                                         "e.upper",
                                         "j.rest",
                                         "f.speed",
                                         "p.x",
                                         "t.y",
                                         "w.com.z"};
    kempe_model *model = read_text(everywhere, NULL, 0);
    kmp_code_source source;
    CHECK(model &&
          kmp_source_init(&source, model,
                          &(kempe_generate_options){.sets = SETS, .drives = true, .keep_parameters = 1}) == KEMPE_OK);
    for (size_t k = 0; model && k < sizeof wanted / sizeof *wanted; k++) {
        bool found = false;
        for (int j = 0; j < source.parameter_count; j++)
            found = found || strcmp(source.parameter_name[j], wanted[k]) == 0;
        if (!found)
            printf("p has no %s\n", wanted[k]);
        CHECK(found);
    }
    for (int j = 0; model && j < source.parameter_count; j++)
        CHECK(strncmp(source.parameter_name[j], "number.", 7) != 0 && strcmp(source.parameter_name[j], "half") != 0);
    kmp_source_free(&source);
    kempe_model_free(model);
}

/* A length that is an axis, too, is no entry; a setting of runs is. */
static void shapes_are_no_entries(void)
{
    kempe_model *model = read_text("kempe: 1\nparameters: {x: 0.3, y: 0.4, T: 2}\nbodies:\n"
                                   "  a: {joint: {revolute: [x, y, 1], at: ground}, mass: 1, com: [x, T, 2*x]}\n"
                                   "run: {t_end: T}\n",
                                   NULL, 0);
    kmp_code_source source;
    warnings[0] = '\0';
    CHECK(model &&
          kmp_source_init(&source, model, &(kempe_generate_options){.sets = "M_C", .keep_parameters = 1}) == KEMPE_OK);
    CHECK_TEXT(warnings, "axes, tables or powers depend on these parameters: they are written as numbers, and p has no "
                         "entry for them: x, y\n");
    for (int j = 0; model && j < source.parameter_count; j++)
        CHECK(strcmp(source.parameter_name[j], "x") != 0 && strcmp(source.parameter_name[j], "y") != 0);
    CHECK(model && source.place[2] >= 0);
    kmp_source_free(&source);
    kempe_model_free(model);
}

/* The largest difference of two sources of the same drawing with their own values in p. */
static double apart(const kmp_code_source *a, const kmp_code_source *b)
{
    double *one = NULL, *other = NULL, most = 0;
    int count = evaluate(a, false, &one);
    CHECK(evaluate(b, false, &other) == count && count > 0);
    for (int k = 0; k < count; k++)
        most = fmax(most, fabs(one[k] - other[k]));
    kmp_free(one);
    kmp_free(other);
    return most;
}

/* With numbers in p, too, the mechanism that is meant is written: its points are the values of p, its axes constants.
 */
static void writes_what_is_meant(const char *path)
{
    char full[1024];
    (void)snprintf(full, sizeof full, "%s/%s", KEMPE_ROOT, path);
    kempe_model *model = read_file(full, NULL, 0), *as_drawn = read_file(full, NULL, 0);
    kempe_generate_options g = {.sets = "h+J"};
    kmp_code_source plain, kept, drawn;
    CHECK(model && as_drawn && kempe_model_set_closure_tolerance(as_drawn, 0) == KEMPE_OK);
    CHECK(kmp_source_init(&plain, model, &g) == KEMPE_OK);
    g.keep_parameters = 1;
    CHECK(kmp_source_init(&kept, model, &g) == KEMPE_OK && kmp_source_init(&drawn, as_drawn, &g) == KEMPE_OK);
    CHECK(kept.parameter_count > 0 && apart(&plain, &kept) < 1e-12);
    bool same = drawn.parameter_count == kept.parameter_count;
    CHECK(same);
    for (int k = 0; same && k < kept.parameter_count; k++) {
        CHECK_TEXT(kept.parameter_name[k], drawn.parameter_name[k]);
        CHECK_NEAR(kept.value[k], drawn.value[k], 5e-6);
    }
    CHECK(apart(&kept, &drawn) > 1e-8);
    kmp_source_free(&plain);
    kmp_source_free(&kept);
    kmp_source_free(&drawn);
    kempe_model_free(model);
    kempe_model_free(as_drawn);
}

static void a_rounded_drawing_is_written_as_meant(void)
{
    writes_what_is_meant("tests/models/rounded_lamp.yaml");
    writes_what_is_meant("tests/models/rounded_bennett.yaml");
}

static void every_model(void)
{
    static char *paths[MOST_MODELS];
    int count = models_list(paths), tried = 0;
    for (int k = 0; k < count; k++) {
        tried += try_model(read_file, paths[k]);
        kmp_free(paths[k]);
    }
    printf("  %d of %d models\n", tried, count);
    CHECK(tried > 60);
}

int main(void)
{
    context = kempe_context_new();
    kempe_context_set_log(context, on_log, NULL);
    TEST(numbers_everywhere);
    TEST(names_of_all);
    TEST(shapes_are_no_entries);
    TEST(a_rounded_drawing_is_written_as_meant);
    TEST(every_model);
    kempe_context_free(context);
    return check_report();
}
