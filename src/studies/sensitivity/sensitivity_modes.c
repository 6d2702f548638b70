/* SPDX-License-Identifier: BSD-3-Clause */
/* Sensitivities of modes: one row, with real and imaginary part, frequency and damping of each. */
#include "dynamics/load_dependent.h"
#include "studies/modes/mode_slopes.h"
#include "studies/sensitivity/sensitivity_state.h"
#include <kempe/sensitivity.h>
#include <math.h>
#include <string.h>

typedef struct work {
    kempe_sensitivity *s;
    const kmp_spectrum *spectrum;
    const kmp_mode_slopes *slopes;
    int *chosen, count; /* eigenvalues of the table: not exactly zero, of a pair the upper one */
} work;

enum { WORDS = 4 };

static int words_of(const work *w, int i)
{
    return w->spectrum->im[i] > 0 ? WORDS : 1;
}

static bool add_columns(work *w)
{
    static const char *const words[WORDS] = {"re", "im", "frequency", "damping"}, *const units[] = {"1/s", "1/s", "Hz",
                                                                                                    ""};
    bool ok = true;
    for (int k = 0; ok && k < w->count; k++)
        for (int c = 0; ok && c < words_of(w, w->chosen[k]); c++) {
            kmp_text name = {0};
            kmp_text_printf(&name, "mode.%d.%s", k + 1, words[c]);
            ok = !name.failed && kmp_sensitivity_add_column(w->s, name.s, units[c]);
            kmp_text_free(&name);
        }
    return ok;
}

/* frequency = im/(2 pi), damping = -re/|s|. */
static bool add_row(work *w)
{
    const double turn = 2 * acos(-1.0);
    int count = w->s->count;
    double *value = kmp_sensitivity_add_row(w->s, 0), *slope = value ? value + w->s->columns : NULL;
    if (!value)
        return false;
    for (int k = 0; k < w->count; k++) {
        int i = w->chosen[k], words = words_of(w, i);
        double re = w->spectrum->re[i], im = w->spectrum->im[i], size = hypot(re, im);
        const double values[WORDS] = {re, im, im / turn, -re / size + 0};
        for (int p = 0; p < count; p++) {
            double dre = w->slopes->re[i * count + p], dim = w->slopes->im[i * count + p];
            double turned = re / size * (dim / size) - im / size * (dre / size); /* of the angle of s */
            const double d[WORDS] = {dre, dim, dim / turn, im / size * turned + 0};
            for (int c = 0; c < words; c++)
                slope[c * count + p] = d[c];
        }
        memcpy(value, values, (size_t)words * sizeof *value);
        value += words;
        slope += words * count;
    }
    return true;
}

/* "of modes 2, 3 .." */
static void list(const work *w, kmp_mode_kind kind, const char *what, kmp_text *note)
{
    int listed = 0;
    for (int k = 0; k < w->count; k++)
        if (w->slopes->kind[w->chosen[k]] == kind)
            kmp_text_printf(note, "%s%d", listed++ ? ", " : note->length ? "; of modes " : "of modes ", k + 1);
    if (listed)
        kmp_text_put(note, what);
}

static bool write_note(work *w)
{
    kmp_text note = {0};
    int zeros = w->spectrum->zeros;
    if (zeros)
        kmp_text_printf(&note, "%d eigenvalue%s exactly zero and omitted", zeros, zeros == 1 ? " is" : "s are");
    list(w, KMP_MODE_REPEATED, ", equal to others, the derivatives are those of all of them, sorted by size", &note);
    list(w, KMP_MODE_DEFECTIVE, ", equal to others with fewer vectors, there are no derivatives", &note);
    if (note.length)
        w->s->note = kmp_text_keep(&note, &w->s->arena);
    return !note.failed && !w->s->arena.failed;
}

/* Derivatives of the modes at the state x; the caller frees the intermediate results. */
static kempe_status find_modes(kmp_sensitivity_state *x, kempe_sensitivity *s, kmp_second_derivatives *second,
                               kmp_spectrum *spectrum, kmp_mode_slopes *slopes)
{
    KMP_TRY(kmp_sensitivity_state_init(x, s, false));
    KMP_TRY(kmp_second_derivatives_init(second, s->system, kmp_backend_find(x->backend), s->count,
                                        (const char *const *)s->name));
    KMP_TRY(kmp_linear_spectrum(&x->varied.linear, spectrum));
    KMP_TRY(kmp_mode_slopes_init(slopes, &x->varied.linear, second, &x->sensitivity_of_state, spectrum));
    work *w = &(work){.s = s, .spectrum = spectrum, .slopes = slopes};
    const kmp_spectrum *sp = w->spectrum;
    w->chosen = KMP_ARENA_NEW(&w->s->arena, int, sp->count);
    for (int i = sp->zeros; w->chosen && i < sp->count; i++)
        if (sp->im[i] >= 0)
            w->chosen[w->count++] = i;
    bool ok = w->chosen && add_columns(w) && add_row(w) && write_note(w);
    return ok ? KEMPE_OK : kmp_fail_memory(w->s->context);
}

static kempe_status find(kempe_sensitivity *s)
{
    kmp_sensitivity_state x = {0};
    kmp_second_derivatives second = {0};
    kmp_spectrum spectrum = {0};
    kmp_mode_slopes slopes = {0};
    if (s->options->outputs)
        return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                        "sensitivities of modes are those of their eigenvalues: outputs cannot be chosen");
    KMP_TRY(kmp_refuse_load_dependent(s->system, "sensitivities of modes"));
    kempe_status status = find_modes(&x, s, &second, &spectrum, &slopes);
    kmp_mode_slopes_free(&slopes);
    kmp_spectrum_free(&spectrum);
    kmp_second_derivatives_free(&second);
    kmp_sensitivity_state_free(&x);
    return status;
}

const kmp_sensitivity_kind kmp_sensitivity_modes = {.name = "modes", .find = find, .holds = true};
