/* SPDX-License-Identifier: BSD-3-Clause */
/* Checkpoints of a four-bar. An input has the rows, before which the lines of the head are put, and the last line after
 * them; one that begins with
 * `#` is the whole file. */
#include "base/memory.h"
#include "fuzz.h"
#include "studies/simulate/checkpoint.h"

static kempe_context *context; /* made once, with what follows */
static kempe_model *model;
static kempe_system *four_bar;
static kmp_text head;

static void prepare(void)
{
    context = fuzz_context_new();
    four_bar = fuzz_four_bar(context, &model);
    fuzz_check_status(context, kmp_checkpoint_head(four_bar, &head));
}

static void read_file(const uint8_t *data, size_t size)
{
    kmp_samples samples;
    kmp_samples_init(&samples, four_bar->n, four_bar->m);
    fuzz_files_set("checkpoint", data, size);
    kmp_context_clear(context);
    kempe_status status = kmp_checkpoint_read(four_bar, "checkpoint", &samples);
    fuzz_check_status(context, status);
    fuzz_promise((status == KEMPE_OK) == (samples.rows > 0), "rows come with KEMPE_OK, and only then");
    for (int k = 1; k < samples.rows; k++)
        fuzz_promise(kmp_samples_time(&samples, k) > kmp_samples_time(&samples, k - 1), "times ascend");
    fuzz_files_clear();
    kmp_samples_free(&samples);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (!four_bar)
        prepare();
    if (size > 0 && data[0] == '#') {
        read_file(data, size);
        return 0;
    }
    char *whole = kmp_calloc(head.length + size + 64, 1);
    kmp_text end = {0};
    fuzz_promise(whole, "there is memory");
    memcpy(whole, head.s, head.length);
    if (size > 0)
        memcpy(whole + head.length, data, size);
    kmp_checkpoint_end(&end, whole, head.length + size);
    fuzz_promise(!end.failed && end.length <= 64, "a short line ends a checkpoint");
    memcpy(whole + head.length + size, end.s, end.length);
    read_file((const uint8_t *)whole, head.length + size + end.length);
    kmp_text_free(&end);
    kmp_free(whole);
    return 0;
}
