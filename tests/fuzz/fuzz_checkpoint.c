/* SPDX-License-Identifier: BSD-3-Clause */
/* Checkpoints of a four-bar, and of a slider with a continuous delay. An input has the rows, before which the lines of
 * the head are put, and the last line after them; one that begins with `~` is of the slider, and one that begins with
 * `#` is the whole file. */
#include "base/context.h"
#include "base/memory.h"
#include "base/text.h"
#include "fuzz.h"
#include "studies/simulate/trajectory.h"
#include <kempe/kempe.h>

enum { PLAIN, DELAYED, SYSTEMS };

static kempe_context *context; /* made once, with what follows */
static kempe_system *systems[SYSTEMS];
static kmp_text heads[SYSTEMS];

static void prepare(void)
{
    static const char delayed[] = "kempe: 1\nstates: {late: {delay: q(x), time: 0.2}}\n"
                                  "bodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 1}}\n";
    kempe_model *models[SYSTEMS];
    context = fuzz_context_new();
    systems[PLAIN] = fuzz_four_bar(context, &models[PLAIN]);
    fuzz_check_status(context, kempe_model_read_text(context, delayed, "slider", &models[DELAYED]));
    fuzz_check_status(context, kempe_system_new(models[DELAYED], &systems[DELAYED]));
    for (int k = 0; k < SYSTEMS; k++)
        fuzz_check_status(context, kmp_checkpoint_head(systems[k], &heads[k]));
}

static void check_past(const kmp_samples *samples, const kmp_past *past)
{
    for (int k = 0; past && k < past->count; k++) {
        const kmp_past_signal *signal = &past->signal[k];
        fuzz_promise(signal->count > 0 && signal->delay > 0, "a signal has a past");
        fuzz_promise(signal->piece[0].from <= kmp_samples_time(samples, samples->rows - 1) - signal->delay,
                     "the past is as long as the delay");
        for (int i = 1; i < signal->count; i++)
            fuzz_promise(signal->piece[i].from == signal->piece[i - 1].to, "polynomials follow each other");
    }
}

static void read_file(const kempe_system *system, const uint8_t *data, size_t size)
{
    kmp_samples samples;
    kmp_past *past = NULL;
    kmp_samples_init(&samples, system->n, system->m);
    fuzz_files_set("checkpoint", data, size);
    kmp_context_clear(context);
    kempe_status status = kmp_checkpoint_read(system, "checkpoint", &samples, &past);
    fuzz_check_status(context, status);
    fuzz_promise((status == KEMPE_OK) == (samples.rows > 0), "rows come with KEMPE_OK, and only then");
    fuzz_promise((status == KEMPE_OK && system == systems[DELAYED]) == (past != NULL), "a past comes with a delay");
    for (int k = 1; k < samples.rows; k++)
        fuzz_promise(kmp_samples_time(&samples, k) > kmp_samples_time(&samples, k - 1), "times ascend");
    check_past(&samples, past);
    fuzz_files_clear();
    kmp_samples_free(&samples);
    kmp_past_free(past);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (!context)
        prepare();
    const int which = size > 0 && data[0] == '~' ? DELAYED : PLAIN;
    data += which;
    size -= (size_t)which;
    if (size > 0 && data[0] == '#' && which == PLAIN) {
        read_file(systems[which], data, size);
        return 0;
    }
    const kmp_text *head = &heads[which];
    char *whole = kmp_calloc(head->length + size + 64, 1);
    kmp_text end = {0};
    fuzz_promise(whole, "there is memory");
    memcpy(whole, head->s, head->length);
    if (size > 0)
        memcpy(whole + head->length, data, size);
    kmp_checkpoint_end(&end, whole, head->length + size);
    fuzz_promise(!end.failed && end.length <= 64, "a short line ends a checkpoint");
    memcpy(whole + head->length + size, end.s, end.length);
    read_file(systems[which], (const uint8_t *)whole, head->length + size + end.length);
    kmp_text_free(&end);
    kmp_free(whole);
    return 0;
}
