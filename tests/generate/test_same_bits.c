/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow not_sanitized 15 */
/* Models whose equations can be written: of each folder of the examples the one of its name, one of three of the others
 * and of the tests (./check full: all of them). Others of a folder are the same mechanism with other numbers or
 * tracks; test_wheel_equations compiles the same functions of its models and compares the same bits. C computes the
 * bits of Kempe's tape and machine code for the same functions, and to rounding the values of the workspace, whose
 * equations are derived all together.
 */
#include "exchange/code/block_parts.h"
#include "full.h"
#include "generate/compiled_equations.h"
#include "generate/models.h"
#include "generate/wheel_models.h"
#include "generate/workspace_equations.h"
#include <kempe/generate.h>

/* Beside the largest entry of its array. */
#define ROUNDING 1e-14

static const kempe_generate_options generation = {.sets = "M_C,h_J,jdqd", .drives = 1, .language = "c"};

typedef struct found {
    int written, bits, others; /* models; those whose workspace has the same bits; other models */
    double most;               /* by which an entry is off, beside the largest one of its array */
} found;

/* -- what the workspace gives -------------------------------------------------------------------------- */

static void compare_workspace(const kempe_model *model, const char *path, int size, found *f)
{
    static double own[MOST_OUT];
    kempe_system *system = NULL;
    bool bits = true;
    double most = 0;
    if (kempe_system_new(model, &system) != KEMPE_OK)
        return;
    if (system->load_row_count > 0) { /* its bias has the multipliers that it solves for */
        kempe_system_free(system);
        return;
    }
    kmp_evaluator *eval = kmp_eval_new(system, "tape");
    int n = system->n, m = system->m;
    const int sizes[] = {n * n, n, m, m * n, m};
    for (int s = 0; s < STATES; s++) {
        CHECK(evaluate(eval, &states[s], own) - own == size);
        const double *a = got[s], *b = own;
        for (int k = 0; k < 5; a += sizes[k], b += sizes[k], k++)
            most = fmax(most, distance(sizes[k], a, b));
        for (int k = 0; k < size; k++)
            bits = bits && same_bits(got[s][k], own[k]);
    }
    if (most > ROUNDING)
        printf("%s: %.3g off what the workspace gives\n", path, most);
    CHECK(most <= ROUNDING);
    f->most = fmax(f->most, most);
    f->bits += bits;
    kmp_eval_free(eval);
    kempe_system_free(system);
}

/* -- every model --------------------------------------------------------------------------------------- */

/* Models that are written and not yet compiled: the compiler and the linker take longer to start than for most models.
 */
typedef struct written {
    kempe_model *model;
    char *path;
    kmp_code_source source;
} written;

enum { MOST_TOGETHER = 24 };

static written together[MOST_TOGETHER];
static int together_count;

static void compare_written(const written *w, void *library, int number, found *f)
{
    const int size = run_tapes(&w->source);
    CHECK(size <= MOST_OUT && w->source.n <= MOST);
    run_shim(library, &w->source, number);
    const int wrong = count_wrong_bits(size);
    if (wrong)
        printf("%s: %d of %d entries differ\n", w->path, wrong, STATES * size);
    CHECK(wrong == 0);
    compare_workspace(w->model, w->path, size, f);
    f->written++;
}

static void compare_together(found *f)
{
    kmp_text text = {0};
    for (int k = 0; k < together_count; k++)
        put_shim(&text, &together[k].source, k);
    void *library = together_count ? compile(&text, false) : NULL;
    for (int k = 0; k < together_count; k++) {
        if (library)
            compare_written(&together[k], library, k, f);
        kmp_source_free(&together[k].source);
        kempe_model_free(together[k].model);
        kmp_free(together[k].path);
    }
    if (library)
        dlclose(library);
    kmp_text_free(&text);
    together_count = 0;
}

/* Its file includes kempe_newton.h, which one file can do. */
static bool solves(const kmp_code_source *source)
{
    const kmp_program *p;
    for (int k = 0; k < source->count; k++)
        for (int i = 0; (p = kmp_code_next_program(&source->routines[k], &i));)
            for (int at = 0; at < p->code[p->stages]; at++)
                if (p->instruction[at].op == KMP_OP_IMPLICIT)
                    return true;
    return false;
}

static bool fits(const kmp_code_source *source)
{
    for (int k = 0; k < together_count; k++)
        if (strcmp(together[k].source.name, source->name) == 0 || (solves(source) && solves(&together[k].source)))
            return false;
    return together_count < MOST_TOGETHER;
}

/* Takes the model and its path. */
static void add_model(kempe_model *model, char *path, found *f)
{
    kempe_code *code = NULL;
    written w = {.model = model, .path = path};
    if (kempe_code_new(model, &generation, &code) != KEMPE_OK ||
        kmp_source_init(&w.source, model, &generation) != KEMPE_OK) {
        f->others++;
        kempe_code_free(code);
        kempe_model_free(model);
        kmp_free(path);
        return;
    }
    if (!fits(&w.source))
        compare_together(f);
    CHECK(kempe_code_write(code, folder) == KEMPE_OK);
    kempe_code_free(code);
    together[together_count++] = w;
}

/* "examples/NAME/NAME.yaml" */
static bool is_named_as_folder(const char *path)
{
    const char *file = strrchr(path, '/');
    const size_t length = file ? strcspn(file + 1, ".") : 0;
    return strncmp(path, "examples/", 9) == 0 && strlen(path) == 9 + 2 * length + strlen("/.yaml") &&
           strncmp(path + 9, file + 1, length) == 0;
}

static bool is_wanted(const char *path, int k)
{
    for (int i = 0; i < WHEEL_MODELS; i++)
        if (strcmp(path, wheel_models[i]) == 0)
            return false;
    return k % 3 == 0 || is_named_as_folder(path);
}

static void every_model(void)
{
    static char *paths[MOST_MODELS];
    found f = {0};
    int count = models_list(paths);
    for (int k = 0; k < count; k++) {
        kempe_model *model = NULL;
        bool wanted = check_full() || is_wanted(paths[k], k);
        if (wanted && kempe_model_read(context, paths[k], &model) == KEMPE_OK)
            add_model(model, paths[k], &f);
        else
            kmp_free(paths[k]);
    }
    compare_together(&f);
    printf("  %d models: the bits of the tape; %d those of the workspace, the others %.2g off; %d cannot be written\n",
           f.written, f.bits, f.most, f.others);
    CHECK(f.written > (check_full() ? 80 : 45));
}

int main(void)
{
    context = kempe_context_new();
    if (!mkdtemp(folder))
        return 1;
    choose_states();
    TEST(every_model);
    char command[128];
    snprintf(command, sizeof command, "rm -r %s", folder);
    CHECK(runs(command));
    kempe_context_free(context);
    return check_report();
}
