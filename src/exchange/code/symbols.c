/* SPDX-License-Identifier: BSD-3-Clause */
/* Searches all numbers of a model; the one with the symbol gives the name. */
#include "exchange/code/symbols.h"
#include "model/data/model.h"
#include "model/data/numbers.h"

typedef struct search {
    kmp_text *text;
    int symbol;
} search;

/* Appends the name when the number has the symbol, and ends the walk. */
static bool is_other(void *user, const kmp_number *number, const char *owner, const char *key, const char *part)
{
    search *s = user;
    if (number->symbol != s->symbol)
        return true;
    kmp_text_printf(s->text, "%s%s%s%s%s", owner, *key ? "." : "", key, part ? "." : "", part ? part : "");
    return false;
}

/* A law that is one number. */
static bool is_law(const search *s, const kmp_expr *law, const char *owner, const char *what)
{
    if (!law || law->symbol != s->symbol)
        return false;
    kmp_text_printf(s->text, "%s.%s", owner, what);
    return true;
}

static bool find_law(const search *s, const kempe_model *model)
{
    static const char *const curves[] = {"curve.1", "curve.2"}, *const xyz[] = {"x", "y", "z"};
    bool found = false;
    for (int k = 0; k < model->closure_count && !found; k++) {
        const kmp_closure *closure = &model->closures[k];
        found = is_law(s, closure->function, closure->name, "function");
        for (int i = 0; i < 2 && !found; i++)
            found = is_law(s, closure->curve[i], closure->name, curves[i]);
    }
    for (int k = 0; k < model->force_count && !found; k++) {
        const kmp_force *force = &model->forces[k];
        found = is_law(s, force->effort, force->name, "effort");
        for (int i = 0; i < 3 && !found; i++)
            found = is_law(s, force->vector[i], force->name, xyz[i]);
    }
    for (int k = 0; k < model->unknowns_count && !found; k++)
        found =
            model->unknowns[k].count == 0 && is_law(s, model->unknowns[k].zero[0], model->unknowns[k].name, "value");
    return found;
}

char *kmp_symbol_name(kmp_arena *arena, const kempe_model *model, int k)
{
    kmp_text text = {0};
    int symbol = k - model->parameter_count + 1;
    search s = {&text, symbol};
    if (symbol <= 0)
        kmp_text_put(&text, model->parameters[k].name);
    else if (kmp_numbers_visit(model, is_other, &s) && !find_law(&s, model))
        kmp_text_printf(&text, "number.%d", symbol);
    return kmp_text_keep(&text, arena);
}
