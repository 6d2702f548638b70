/* SPDX-License-Identifier: BSD-3-Clause */
/* Expressions: by themselves (written and read again, valued), and as the torque of a motor whose equations are
 * derived.
 */
#include "base/memory.h"
#include "fuzz.h"
#include "model/language/expression.h"
#include "model/language/expression_dimension.h"
#include "model/language/expression_print.h"
#include "model/language/expression_value.h"

static const char *const parameters[] = {"a", "b", "L1"};
static const double values[] = {0.3, -2, 1.5};
static const char *const coordinates[] = {"A", "B"}, *const closures[] = {"A", "B"};
static const char *const points[] = {"one.P", "two.Q"};

static int find(const char *const *names, int count, const char *name)
{
    for (int k = 0; k < count; k++)
        if (strcmp(names[k], name) == 0)
            return k;
    return -1;
}

static int find_parameter(void *user, const char *name)
{
    (void)user;
    return find(parameters, 3, name);
}

static int find_coordinate(void *user, const char *name)
{
    (void)user;
    return find(coordinates, 2, name);
}

static int find_closure(void *user, const char *name)
{
    (void)user;
    return find(closures, 2, name);
}

static bool find_point(void *user, const char *text, const char *word, int column, kmp_measure_argument *argument)
{
    kempe_context *context = user;
    int point = find(points, 2, text);
    if (point < 0)
        (void)kmp_complain(context, "expression", 1, column, "%s: no point '%s'", word, text);
    else
        *argument = (kmp_measure_argument){.point = point, .name = points[point]};
    return point >= 0;
}

static const kmp_expr *parse(kmp_arena *arena, const char *text)
{
    kempe_context *context = fuzz_context_new();
    kmp_expr_scope scope = {.context = context,
                            .arena = arena,
                            .file = "expression",
                            .line = 1,
                            .column = 1,
                            .parameter = find_parameter,
                            .coordinate = find_coordinate,
                            .closure = find_closure,
                            .user = context,
                            .point = find_point,
                            .time = true};
    const kmp_expr *expr = kmp_expr_parse(&scope, text);
    fuzz_promise(!arena->failed, "there is memory");
    fuzz_check_status(context, expr ? KEMPE_OK : KEMPE_E_INPUT);
    kempe_context_free(context);
    return expr;
}

static char *text_of(const kmp_expr *expr)
{
    const kmp_expr_names names = {KMP_NAMES_OF(parameters), KMP_NAMES_OF(coordinates), KMP_NAMES_OF(closures), {0}, 0};
    kmp_text text = {0};
    kmp_expr_print(&text, expr, &names);
    char *s = kmp_text_take(&text);
    fuzz_promise(s, "there is memory");
    return s;
}

static bool same(double x, double y)
{
    return memcmp(&x, &y, sizeof x) == 0 || (x != x && y != y);
}

static void write_and_read(const kmp_expr *expr)
{
    const kmp_dimension dimensions[3] = {KMP_DIM_NUMBER, KMP_DIM_ANY, KMP_DIM_LENGTH};
    kmp_arena arena = {0};
    kmp_expr_fault fault = {0};
    char *first = text_of(expr);
    const kmp_expr *again = parse(&arena, first);
    fuzz_promise(again, "what is written can be read");
    char *second = text_of(again);
    fuzz_promise(strcmp(first, second) == 0, "what was read is written in the same way");
    fuzz_promise(same(kmp_expr_value_at(expr, values, 0.7), kmp_expr_value_at(again, values, 0.7)),
                 "what is written has the same value");
    (void)kmp_expr_dimension(expr, dimensions, values, &fault);
    if (fault.at) {
        kmp_text sentence = {0};
        kmp_expr_print_fault(&sentence, &fault);
        fuzz_promise(sentence.length > 0, "a fault has a sentence");
        kmp_text_free(&sentence);
    }
    kmp_free(second);
    kmp_free(first);
    kmp_arena_free(&arena);
}

static void derive(const char *expression, unsigned choice)
{
    kempe_context *context = fuzz_context_new();
    kempe_model *model = NULL;
    kmp_text text = {0};
    kmp_text_put(&text, "kempe: 1\nparameters: {a: 0.3, b: -2, L1: 1.5}\n"
                        "ground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                        "  one: {joint: {name: A, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1}, "
                        "points: {P: [1, 0, 0]}}\n"
                        "  two: {joint: {name: B, revolute: z, at: one.P}, mass: 1, inertia: {zz: 1}, "
                        "points: {Q: [1, 0.5, 0]}}\n"
                        "forces: {motor: {joint: B, torque: ");
    kmp_text_quote(&text, expression);
    kmp_text_put(&text, "}}\n");
    char *s = kmp_text_take(&text);
    fuzz_promise(s, "there is memory");
    kempe_status status = kempe_model_read_text(context, s, "model", &model);
    fuzz_check_status(context, status);
    if (model)
        fuzz_walk_model(context, model, choice);
    kempe_context_free(context);
    kmp_free(s);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    kmp_arena arena = {0};
    char *text = kmp_calloc(size + 1, 1);
    fuzz_promise(text, "there is memory");
    if (size > 0)
        memcpy(text, data, size);
    const kmp_expr *expr = parse(&arena, text);
    if (expr) {
        unsigned choice = fuzz_hash(data, size);
        write_and_read(expr);
        if (choice % 64 == 0) /* takes a hundred times as long */
            derive(text, choice / 64);
    }
    kmp_arena_free(&arena);
    kmp_free(text);
    return 0;
}
