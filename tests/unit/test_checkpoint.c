/* SPDX-License-Identifier: BSD-3-Clause */
/* A checkpoint is taken whole or not at all: any byte of it that is changed, left out or put in makes it no
 * checkpoint, and so does every other length. A run goes on from it as if it had not ended, also at the kink of a
 * drive.
 */
#include "base/context.h"
#include "base/file.h"
#include "base/memory.h"
#include "loaded.h"
#include "studies/simulate/trajectory.h"
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char path[] = "/tmp/kempe_checkpoint_XXXXXX";

/* The file of a short run. */
static char *make(const loaded *l, size_t *length)
{
    kempe_run_options run = {.t_end = 0.01, .no_convergence_check = 1, .checkpoint = path};
    kempe_trajectory *t = NULL;
    char *text = NULL;
    CHECK(kempe_simulate(l->system, &run, &t) == KEMPE_OK);
    kempe_trajectory_free(t);
    CHECK(kmp_file_read(l->context, KMP_FILE_CHECKPOINT, path, &text, length) == KEMPE_OK);
    return text;
}

static kempe_status take(const loaded *l, const char *text, size_t length, int *rows)
{
    kmp_samples samples;
    kmp_past *past = NULL;
    FILE *file = fopen(path, "wb");
    CHECK(file && fwrite(text, 1, length, file) == length && fclose(file) == 0);
    kmp_samples_init(&samples, l->system->n, l->system->m);
    kempe_status status = kmp_checkpoint_read(l->system, path, &samples, &past);
    *rows = samples.rows;
    kmp_samples_free(&samples);
    kmp_past_free(past);
    return status;
}

static void a_whole_one_is_read(void)
{
    loaded l = load("examples/four_bar/four_bar.yaml");
    size_t length = 0;
    int rows = 0;
    char *text = make(&l, &length);
    CHECK(take(&l, text, length, &rows) == KEMPE_OK && rows == 2);
    kmp_free(text);
    unload(&l);
}

static void no_byte_may_differ(void)
{
    static const unsigned char changes[] = {0x01, 0x20};
    loaded l = load("examples/four_bar/four_bar.yaml");
    size_t length = 0;
    int rows = 0;
    char *text = make(&l, &length), *other = malloc(length + 2);
    for (size_t at = 0; at < length; at++) {
        for (size_t k = 0; k < sizeof changes; k++) {
            memcpy(other, text, length);
            other[at] = (char)((unsigned char)other[at] ^ changes[k]);
            CHECK(take(&l, other, length, &rows) == KEMPE_E_INPUT && rows == 0);
        }
        memcpy(other, text, at);
        memcpy(other + at, text + at + 1, length - at - 1);
        CHECK(take(&l, other, length - 1, &rows) == KEMPE_E_INPUT && rows == 0);
        other[at] = '0';
        memcpy(other + at + 1, text + at, length - at);
        CHECK(take(&l, other, length + 1, &rows) == KEMPE_E_INPUT && rows == 0);
        CHECK(take(&l, text, at, &rows) == KEMPE_E_INPUT && rows == 0);
    }
    memcpy(other, text, length);
    memcpy(other + length, "\n", 1);
    CHECK(take(&l, other, length + 1, &rows) == KEMPE_E_INPUT);
    free(other);
    kmp_free(text);
    unload(&l);
}

/* A model with equal names and another length. */
static void it_belongs_to_its_parameters(void)
{
    loaded l = load("examples/four_bar/four_bar.yaml"),
           longer = load_set("examples/four_bar/four_bar.yaml", &(kempe_setting){"coupler_mass", "2"}, 1);
    size_t length = 0;
    int rows = 0;
    char *text = make(&l, &length);
    CHECK(take(&longer, text, length, &rows) == KEMPE_E_INPUT);
    CHECK(strstr(kempe_context_message(longer.context), "another model"));
    kmp_free(text);
    unload(&longer);
    unload(&l);
}

/* The same model with another start, which the message says; with another start and other values, another model. */
static void it_belongs_to_its_start(void)
{
    static const double q[] = {1.2, NAN, NAN};
    loaded l = load("examples/four_bar/four_bar.yaml"),
           longer = load_set("examples/four_bar/four_bar.yaml", &(kempe_setting){"coupler_mass", "2"}, 1);
    const loaded *const of[] = {&l, &longer};
    size_t length = 0;
    int rows = 0;
    char *text = make(&l, &length);
    for (int k = 0; k < 2; k++) {
        loaded other = *of[k];
        CHECK(kempe_model_start_at(of[k]->model, q, NULL, &other.model) == KEMPE_OK);
        CHECK(kempe_system_new(other.model, &other.system) == KEMPE_OK);
        CHECK(take(&other, text, length, &rows) == KEMPE_E_INPUT && rows == 0);
        CHECK(
            check_says(kempe_context_message(other.context), k ? "of another model" : "this model from another start"));
        kempe_system_free(other.system);
        kempe_model_free(other.model);
    }
    kmp_free(text);
    unload(&longer);
    unload(&l);
}

/* The result of a run until t_end, from the file if it resumes. */
static kempe_trajectory *run_on(const loaded *l, double t_end, bool resumes, const char *formulation, kempe_status want)
{
    kempe_run_options run = {.t_end = t_end, .checkpoint = resumes ? NULL : path, .resume = resumes ? path : NULL};
    kempe_trajectory *t = NULL;
    run.formulation = formulation;
    CHECK(kempe_simulate(l->system, &run, &t) == want);
    return t;
}

/* At the kink of a drive the state of the file is before the jump of the rates: the run goes on behind it. */
static void a_kink_is_passed(void)
{
    static const char *const formulations[] = {NULL, "projected", "dae"};
    static const char *const drives[] = {"if(t < 1, 0, t - 1)", "max(0, t - 1)", "if(t < 1, t^2, 2 - t)"};
    for (size_t k = 0; k < sizeof drives / sizeof *drives; k++)
        for (size_t i = 0; i < sizeof formulations / sizeof *formulations; i++) {
            static char text[1024];
            (void)snprintf(text, sizeof text,
                           "kempe: 1\n"
                           "gravity: [0, -9.81, 0]\n"
                           "bodies:\n"
                           "  cart: {joint: {name: x, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
                           "  rod: {joint: {name: A, revolute: z, at: cart.P}, mass: 1, com: [0, -0.5, 0], inertia: "
                           "{zz: 0.1}}\n"
                           "drives: {d: {joint: x, displacement: '%s'}}\n",
                           drives[k]);
            loaded l = load_text(text);
            kempe_trajectory *whole = run_on(&l, 2, false, formulations[i], KEMPE_OK);
            kempe_trajectory_free(run_on(&l, 1, false, formulations[i], KEMPE_OK));
            kempe_trajectory *rest = run_on(&l, 2, true, formulations[i], KEMPE_OK);
            const double *q = whole ? kempe_trajectory_q(whole, kempe_trajectory_row_count(whole) - 1) : NULL;
            const double *after = rest ? kempe_trajectory_q(rest, kempe_trajectory_row_count(rest) - 1) : NULL;
            CHECK(q && after && fabs(q[1]) > 0.05);
            CHECK(q && after && fabs(q[0] - after[0]) < 1e-6 && fabs(q[1] - after[1]) < 1e-6);
            kempe_trajectory_free(whole);
            kempe_trajectory_free(rest);
            unload(&l);
        }
}

static int count(const char *text, const char *word)
{
    int found = 0;
    for (const char *at = text; (at = strstr(at, word)); at++)
        found++;
    return found;
}

/* A reason for doubt before the checkpoint is not said again of a later time; another reason is. */
static void a_doubt_is_said_once(void)
{
    loaded l = load_text("kempe: 1\n"
                         "tables: {a: {x: [0, 1, 2, 3], y: [0, 1, 2, 3.5]}, b: {x: [0, 2, 4, 5], y: [0, 1, 2, 3]}}\n"
                         "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
                         "forces: {f: {joint: x, force: 'a(t) + b(t)'}}\n");
    kempe_trajectory_free(run_on(&l, 4, false, NULL, KEMPE_UNTRUSTED));
    kempe_trajectory_free(run_on(&l, 6, true, NULL, KEMPE_UNTRUSTED));
    const char *doubts = kmp_context_doubts(l.context);
    CHECK(count(doubts, "\n") == 2 && count(doubts, "table 'a'") == 1 && count(doubts, "table 'b'") == 1);
    CHECK(strncmp(doubts, KMP_BEFORE_CHECKPOINT, strlen(KMP_BEFORE_CHECKPOINT)) == 0);
    unload(&l);
}

int main(void)
{
    int file = mkstemp(path);
    CHECK(file >= 0 && close(file) == 0);
    TEST(a_whole_one_is_read);
    TEST(no_byte_may_differ);
    TEST(it_belongs_to_its_parameters);
    TEST(it_belongs_to_its_start);
    TEST(a_kink_is_passed);
    TEST(a_doubt_is_said_once);
    (void)unlink(path);
    return check_report();
}
