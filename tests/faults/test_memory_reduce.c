/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow 3 */
/* Every allocation fails once (test_memory.c), of reductions of meshes. */
#include "exhaust.h"
#include <kempe/reduce.h>

#define MODELS KEMPE_ROOT "/tests/models/"

static kempe_status reduce(const scene *s, const char *mesh, const kempe_reduce_options *options)
{
    kempe_reduction *made = NULL;
    char *text = NULL, path[] = "/tmp/kempe_memory_XXXXXX.npz";
    const int file = mkstemps(path, 4);
    CHECK(file >= 0);
    kempe_status status = kempe_reduction_new(s->context, mesh, options, &made);
    untouched(status, made);
    if (status == KEMPE_OK)
        status = kempe_reduction_write(made, path);
    for (int format = 0; format < 2 && status == KEMPE_OK; format++) {
        status = kempe_reduction_print(made, format ? KEMPE_JSON : KEMPE_TEXT, &text);
        untouched(status, text);
        kempe_text_free(text);
        text = NULL;
    }
    kempe_reduction_free(made);
    close(file);
    unlink(path);
    return status;
}

static kempe_status reduce_texts(scene *s)
{
    const kempe_reduce_options options = {.interfaces = "root=x=0,tip=8-11",
                                          .modes = 2,
                                          .frame = "chord",
                                          .units = "m kg s",
                                          .mass = MODELS "brick_mass.mtx",
                                          .nodes = MODELS "brick_nodes.txt"};
    return reduce(s, MODELS "brick.mtx", &options);
}

static kempe_status reduce_matrices(scene *s)
{
    const kempe_reduce_options options = {.interfaces = "root=ROOT", .modes = 2, .units = "mm t s"};
    return reduce(s, MODELS "calculix/steel_bar.sti", &options);
}

static kempe_status reduce_arrays(scene *s)
{
    const kempe_reduce_options options = {.interfaces = "root=x=0", .modes = 2};
    return reduce(s, MODELS "brick.npz", &options);
}

static const named_stage stages[] = {{"texts", reduce_texts}, {"matrices", reduce_matrices}, {"arrays", reduce_arrays}};

int main(void)
{
    return exhaust_alone(stages, sizeof stages / sizeof *stages, 29);
}
