/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow not_sanitized 19 */
/* Equations with implicit blocks and averages over places in C, Python and Octave, at states about the start of models,
 * where wheels are on their rails: C computes the bits of the tape. All agree with the workspace of the library to
 * ALLOWED beside the largest entry of each array. */
#include "generate/interpreted_equations.h"
#include "generate/wheel_models.h"
#include "generate/workspace_equations.h"
#include <kempe/check.h>
#include <kempe/generate.h>

#define ALLOWED 1e-12

static double own[STATES][MOST_OUT];

/* The start, and places and rates beside it. */
static bool choose_states_about_start(const kempe_model *model, const kempe_system *system)
{
    static const double off[STATES] = {0, 1e-6, 1e-4}, rate[STATES] = {0, 1e-3, 0.1};
    kempe_assembly *start = NULL;
    CHECK(kempe_assembly_new(system, &start) == KEMPE_OK);
    for (int s = 0; start && s < STATES; s++)
        for (int k = 0; k < kempe_model_coordinate_count(model); k++) {
            states[s].q[k] = kempe_assembly_q(start)[k] + between(-off[s], off[s]);
            states[s].qd[k] = kempe_assembly_qd(start)[k] + between(-rate[s], rate[s]);
        }
    for (int s = 0; s < STATES; s++)
        states[s].time[0] = 0;
    kempe_assembly_free(start);
    return start;
}

/* The largest difference of the results from others, beside the largest entry of each array. */
static double off_by(const kmp_code_source *source, double other[STATES][MOST_OUT])
{
    double most = 0;
    for (int s = 0; s < STATES; s++)
        for (int k = 0, at = 0; k < source->count; k++)
            for (int a = 0; a < source->routines[k].array_count; a++) {
                const int size = size_of(&source->routines[k].arrays[a]);
                most = fmax(most, distance(size, got[s] + at, other[s] + at));
                at += size;
            }
    return most;
}

static bool all_finite(int size, double values[STATES][MOST_OUT])
{
    for (int s = 0; s < STATES; s++)
        for (int k = 0; k < size; k++)
            if (!isfinite(values[s][k]))
                return false;
    return true;
}

/* M, C, h, J and jdqd of the workspace, and the multipliers on which it settles where forces depend on them. */
static void take_workspace(const kempe_system *system)
{
    kmp_evaluator *eval = kmp_eval_new(system, "tape");
    for (int s = 0; s < STATES; s++) {
        (void)evaluate(eval, &states[s], own[s]);
        for (int r = 0; eval->nu && r < system->m; r++)
            states[s].lambda[r] = eval->nu[r];
    }
    kmp_eval_free(eval);
}

static bool runs_in(const char *language)
{
    return strcmp(language, "python") == 0 ? python() != NULL : strcmp(language, "octave") == 0 ? has_octave() : true;
}

static void try_in(const kempe_model *model, const char *language)
{
    const kempe_generate_options g = {.sets = "M_C,h_J,jdqd", .drives = 1, .language = language};
    const bool c = strcmp(language, "c") == 0;
    kmp_code_source source;
    CHECK(kmp_source_init(&source, model, &g) == KEMPE_OK);
    const int size = run_tapes(&source);
    CHECK(size > 0 && size <= MOST_OUT && source.n <= MOST);
    bool ran = emit(model, &g);
    if (ran)
        ran = c                                 ? run_c(&source, false)
              : strcmp(language, "octave") == 0 ? run_octave(&source, size)
                                                : run_python(&source, size);
    CHECK(ran);
    if (ran) {
        CHECK(!c || count_wrong_bits(size) == 0);
        CHECK(all_finite(size, expected) && all_finite(size, own) && all_finite(size, got));
        const double tape = off_by(&source, expected), workspace = off_by(&source, own);
        printf("  %-24s %-7s %.1e off the tape, %.1e off the workspace\n", source.name, language, tape, workspace);
        CHECK(tape <= ALLOWED && workspace <= ALLOWED);
    }
    kmp_source_free(&source);
}

/* Groups of one to three unknowns, and one whose iteration has to halve its steps. */
static const char unknowns[] =
    "kempe: 1\nname: unknowns\ngravity: [0, -9.81, 0]\n"
    "algebraic:\n"
    "  one: {of: {a: 0.1}, zero: a + sin(a) - 0.5*q(A)}\n"
    "  pair: {of: {b: 1, c: 0}, zero: [\"b^2 + c^2 - 1 - a^2\", \"c - 0.5*b - 0.1*q(B)\"]}\n"
    "  three: {of: {d: 1, e: 0, f: 1}, zero: [\"d + e*f - 1 - a\", \"e - 0.3*sin(d + q(A))\", \"f^3 + f - 2 - e\"]}\n"
    "  far: {of: {g: 20, h: 0}, zero: [\"log(g) - 0.1*q(B)\", h - 0.025*g]}\n"
    "bodies:\n"
    "  a: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.3, 0, 0], inertia: {zz: 0.1}, points: {P: [1, "
    "0, "
    "0]}}\n"
    "  b: {joint: {name: B, revolute: z, at: a.P}, mass: 2, com: [0.2, 0.1, 0], inertia: {zz: 0.1}}\n"
    "forces: {m: {joint: A, torque: \"(1 N*m)*(a + b*c + d*e*f + g + h)\"}}\n"
    "start: {q: {A: 0.4, B: -0.3}}\n";

static void try_model(const kempe_model *model)
{
    static const char *const languages[] = {"c", "python", "octave"};
    kempe_system *system = NULL;
    CHECK(kempe_system_new(model, &system) == KEMPE_OK);
    const bool chosen = system && choose_states_about_start(model, system);
    if (chosen)
        take_workspace(system);
    for (int k = 0; chosen && k < 3; k++) {
        if (runs_in(languages[k]))
            try_in(model, languages[k]);
        else
            printf("skipped: no %s here\n", languages[k]);
    }
    kempe_system_free(system);
}

static void wheels(void)
{
    for (int k = 0; k < WHEEL_MODELS; k++) {
        kempe_model *model = NULL;
        CHECK(kempe_model_read(context, wheel_models[k], &model) == KEMPE_OK);
        if (model)
            try_model(model);
        kempe_model_free(model);
    }
}

static void unknowns_of_users(void)
{
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(context, unknowns, "unknowns", &model) == KEMPE_OK);
    if (model)
        try_model(model);
    else
        printf("%s\n", kempe_context_message(context));
    kempe_model_free(model);
}

int main(void)
{
    context = kempe_context_new();
    if (!mkdtemp(folder))
        return 1;
    choose_states();
    TEST(wheels);
    TEST(unknowns_of_users);
    end_interpreters();
    char command[128];
    snprintf(command, sizeof command, "rm -r %s", folder);
    CHECK(runs(command));
    kempe_context_free(context);
    return check_report();
}
