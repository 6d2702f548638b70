/* SPDX-License-Identifier: BSD-3-Clause */
/* The film of a journal: its law over the place and the rate of the journal, as rows and steps of film_laws.def. */
#include "model/read/read_film.h"
#include "model/data/model.h"
#include "model/language/expression_value.h"
#include "model/read/read_journal.h"
#include "model/read/read_values.h"
#include <string.h>

static const kmp_key film_keys[] = {
#include "model/read/film_keys.def"
    {0}};

/* A law's row, or a step of the law before it. */
typedef struct film_row {
    const char *law, *name, *formula;
} film_row;

static const film_row rows[] = {
#define KMP_FILM_LAW(word, scale, source) {word, "scale", scale},
#define KMP_FILM_STEP(name, formula)      {NULL, name, formula},
#include "model/data/film_laws.def"
#undef KMP_FILM_LAW
#undef KMP_FILM_STEP
};

enum { ROWS = sizeof rows / sizeof *rows };

#define KMP_PLACE(k)                                                                                                   \
    {                                                                                                                  \
        .kind = KMP_EXPR_PLACE, .index = (k)                                                                           \
    }
static const kmp_expr places[] = {KMP_PLACE(KMP_LOCAL_FILM_X), KMP_PLACE(KMP_LOCAL_FILM_Y), KMP_PLACE(KMP_LOCAL_FILM_U),
                                  KMP_PLACE(KMP_LOCAL_FILM_V)};
static const char *const place_names[] = {"x", "y", "u", "v"};

/* The laws alone, for a choice. */
static int find_law(kmp_reader *r, const kmp_yaml *node, const char *what)
{
    const char *words[ROWS];
    int at[ROWS], count = 0;
    for (int k = 0; k < ROWS; k++)
        if (rows[k].law) {
            words[count] = rows[k].law;
            at[count++] = k;
        }
    int found = kmp_read_choice(r, node, what, KMP_NAMES(words, count), "the law is", " or ");
    return found < 0 ? -1 : at[found];
}

static const kmp_expr *read_number(kmp_reader *r, const kmp_yaml *map, const char *what, const char *key)
{
    const kmp_yaml *node = kmp_read_required(r, map, what, key);
    const char *of = kmp_reader_say(r, "the %s of %s", key, what);
    kmp_number number;
    if (!node || !kmp_read_number(r, node, of, kmp_key_dimension(film_keys, key), &number) ||
        !kmp_check_rule(r, node, of, KMP_FIELD_POSITIVE, number.value, ""))
        return NULL;
    return kmp_read_as_expr(r, &number);
}

const kmp_film *kmp_read_film(kmp_reader *r, const kmp_yaml *map, const char *of, const kmp_expr *clearance,
                              const kmp_expr *radius)
{
    const char *what = kmp_reader_say(r, "film of %s", of);
    kmp_film *film = KMP_ARENA_NEW(&r->model->arena, kmp_film, 1);
    if (!film || !kmp_read_map(r, map, what, film_keys))
        return NULL;
    const kmp_yaml *word = kmp_read_required(r, map, what, "law");
    int law = word ? find_law(r, word, what) : -1;
    kmp_expr_locals numbers = {0};
    kmp_add_local(&numbers, "viscosity", read_number(r, map, what, "viscosity"));
    kmp_add_local(&numbers, "length", read_number(r, map, what, "length"));
    kmp_add_local(&numbers, "least", read_number(r, map, what, "least"));
    kmp_add_local(&numbers, "clearance", clearance);
    kmp_add_local(&numbers, "radius", radius);
    if (law < 0 || numbers.count < 5)
        return NULL;
    *film = (kmp_film){.law = rows[law].law};
    film->scale = kmp_read_formula(r, rows[law].formula, &numbers);
    film->drag = kmp_read_formula(r, "2*pi*viscosity*radius^3*length/clearance", &numbers);
    film->most = kmp_read_formula(r, "1 - least/clearance", &numbers);
    /* The steps of a law, of which the last two are its force. */
    kmp_expr_locals locals = {0};
    for (int k = 0; k < 4; k++)
        kmp_add_local(&locals, place_names[k], &places[k]);
    for (int k = law + 1; k < ROWS && !rows[k].law; k++) {
        const kmp_expr *step = kmp_read_formula(r, rows[k].formula, &locals);
        kmp_add_local(&locals, rows[k].name, step);
        film->force[0] = film->force[1];
        film->force[1] = step;
    }
    if (film->most && kmp_expr_value(film->most, r->parameter_values) <= 0)
        kmp_reader_complain(r, map->place, "%s: the least thickness of the film is not below the clearance", what);
    return film;
}
