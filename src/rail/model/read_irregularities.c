/* SPDX-License-Identifier: BSD-3-Clause */
/* Irregularities of a track: tables over the arc length, or generated from a spectrum. */
#include "rail/model/read_irregularities.h"
#include "model/language/limits.h"
#include "model/read/read_tables.h"
#include "model/read/read_values.h"
#include "rail/model/wave_spectrum.h"
#include <math.h>

static const kmp_key irregularity_keys[] = {
#include "model/keys/irregularity_keys.def"
    {0}};
static const char *const spectrum_keys[] = {"seed", "from", "to", "wavelengths", "scale"};

static const double farthest = 1e6, finest = 1e-3; /* m */
static const double largest_scale = 1000;

typedef struct reading {
    kmp_reader *r;
    const kmp_yaml *map;
    const char *what;
    kmp_wave_spectrum *spectrum;
} reading;

static bool read_value(const reading *c, const kmp_yaml *node, const char *key, double *value)
{
    return kmp_read_fixed(c->r, node, kmp_reader_say(c->r, "%s of %s", key, c->what),
                          kmp_key_dimension(irregularity_keys, key), value);
}

static bool read_kind(const reading *c, const kmp_yaml *node)
{
    if (!kmp_read_word(c->r, node, kmp_reader_say(c->r, "spectrum of %s", c->what)))
        return false;
    c->spectrum->kind = kmp_read_choice(c->r, node, c->what, kmp_wave_spectrum_words, "spectra are", ", ");
    return c->spectrum->kind >= 0;
}

static bool read_seed(const reading *c)
{
    const kmp_yaml *node = kmp_read_required(c->r, c->map, c->what, "seed");
    double *seed = &c->spectrum->seed;
    if (!node || !read_value(c, node, "seed", seed))
        return false;
    if (*seed >= 0 && *seed <= 1e9 && *seed == floor(*seed))
        return true;
    return kmp_reader_complain(c->r, node->place, "seed of %s is an integer up to 1e9, not %.9g", c->what, *seed);
}

static bool read_stretch(const reading *c)
{
    const kmp_yaml *from = kmp_yaml_get(c->map, "from"), *to = kmp_read_required(c->r, c->map, c->what, "to");
    bool good = !from || read_value(c, from, "from", &c->spectrum->from);
    if (!to || !read_value(c, to, "to", &c->spectrum->to) || !good)
        return false;
    if (fmax(fabs(c->spectrum->from), fabs(c->spectrum->to)) <= farthest)
        return true;
    return kmp_reader_complain(c->r, to->place,
                               "%s are made within %.9g m of the track's beginning, not from %.9g m to %.9g m", c->what,
                               farthest, c->spectrum->from, c->spectrum->to);
}

static bool read_wavelengths(const reading *c)
{
    const kmp_yaml *list = kmp_yaml_get(c->map, "wavelengths");
    double *shortest = &c->spectrum->shortest, *longest = &c->spectrum->longest;
    if (!list)
        return true;
    const char *what = kmp_reader_say(c->r, "wavelengths of %s", c->what);
    if (!kmp_read_list(c->r, list, what, 2) || !read_value(c, list->items[0], "wavelengths", shortest) ||
        !read_value(c, list->items[1], "wavelengths", longest))
        return false;
    if (*shortest >= finest && *longest > *shortest)
        return true;
    return kmp_reader_complain(c->r, list->place,
                               "%s are the shortest and the longest one, at least %.9g m, not %.9g and %.9g", what,
                               finest, *shortest, *longest);
}

static bool check_size(const reading *c)
{
    const kmp_wave_spectrum *s = c->spectrum;
    bool waves = s->longest / s->shortest <= KMP_MOST_SPECTRUM_KNOTS, lasts = s->to - s->from >= s->shortest;
    if (waves && lasts && kmp_wave_spectrum_knots(s) <= KMP_MOST_SPECTRUM_KNOTS)
        return true;
    if (!lasts)
        kmp_reader_complain(c->r, c->map->place, "%s go from %.9g m to %.9g m, which is shorter than a wave of %.9g m",
                            c->what, s->from, s->to, s->shortest);
    else
        kmp_reader_complain(c->r, c->map->place,
                            "%s: too many waves of %.9g m to %.9g m over %.9g m; at most %d points are made, 16 a wave",
                            c->what, s->shortest, s->longest, s->to - s->from, KMP_MOST_SPECTRUM_KNOTS);
    return false;
}

static bool read_scale(const reading *c)
{
    const kmp_yaml *node = kmp_yaml_get(c->map, "scale");
    double *scale = &c->spectrum->scale;
    if (!node)
        return true;
    if (!read_value(c, node, "scale", scale))
        return false;
    if (*scale >= 0 && *scale <= largest_scale)
        return true;
    return kmp_reader_complain(c->r, node->place, "scale of %s is a factor from 0 to %.9g, not %.9g", c->what,
                               largest_scale, *scale);
}

static bool read_spectrum(const reading *c)
{
    bool good = read_kind(c, kmp_yaml_get(c->map, "spectrum"));
    good = read_seed(c) && good;
    good = read_stretch(c) && good;
    good = read_wavelengths(c) && good;
    good = read_scale(c) && good;
    return good && check_size(c);
}

void kmp_read_irregularities(kmp_reader *r, const kmp_yaml *map, const char *what, kmp_track *track)
{
    kmp_irregularities *all = &track->irregularities;
    double range[2] = {0};
    (void)kmp_key_default(irregularity_keys, "wavelengths", 2, range);
    all->spectrum = (kmp_wave_spectrum){.kind = -1, .shortest = range[0], .longest = range[1]};
    (void)kmp_key_default(irregularity_keys, "scale", 1, &all->spectrum.scale);
    reading c = {r, map, kmp_reader_say(r, "the irregularities of %s", what), &all->spectrum};
    if (!map || !kmp_read_map(r, map, c.what, irregularity_keys))
        return;
    for (int k = 0; k < KMP_IRREGULARITIES; k++) {
        const char *key = kmp_irregularity_words[k];
        const kmp_yaml *node = kmp_yaml_get(map, key);
        if (node)
            all->named[k] = kmp_read_table_name(r, node, kmp_reader_say(r, "%s of %s", key, c.what));
    }
    if (kmp_yaml_get(map, "spectrum")) {
        if (read_spectrum(&c) && !r->wrong) {
            /* Irregularities that no file names are made from the spectrum. */
            for (int k = 0; k < KMP_IRREGULARITIES; k++) {
                if (all->named[k] || kmp_wave_spectrum_density(c.spectrum->kind, (kmp_irregularity)k, 1) == 0)
                    continue;
                all->made[k] = kmp_wave_spectrum_make(c.spectrum, (kmp_irregularity)k);
                if (!all->made[k])
                    c.r->scratch.failed = true;
            }
        }
        return;
    }
    for (size_t k = 0; k < sizeof spectrum_keys / sizeof *spectrum_keys; k++) {
        const kmp_yaml *node = kmp_yaml_get(map, spectrum_keys[k]);
        if (node)
            kmp_reader_complain(r, node->place, "%s have no spectrum, but %s needs one", c.what, spectrum_keys[k]);
    }
}
