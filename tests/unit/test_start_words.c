/* SPDX-License-Identifier: BSD-3-Clause */
/* The state at which motions begin, by its word: builds without equilibria refuse that one by name, with the place in
 * the model file. */
#include "base/wings.h"
#include "loaded.h"

#define MODEL(at)                                                                                                      \
    "kempe: 1\nbodies: {a: {joint: {name: A, prismatic: x, at: ground}, mass: 1}}\n"                                   \
    "forces: {f: {joint: A, force: '1 - q(A)'}}\nstart: {at: " at "}\nrun: {t_end: 1}\n"

static bool has_equilibria(void)
{
    bool found = false;
    for (const kmp_wing *const *wing = kmp_wings; *wing; wing++)
        found = found || (*wing)->balance;
    return found;
}

static void a_build_without_equilibria_refuses_them(void)
{
    loaded l = load_text(MODEL("start"));
    kempe_model *started = NULL;
    if (has_equilibria()) {
        CHECK(kempe_model_start_in(l.model, "equilibrium", &started) == KEMPE_OK);
    } else {
        CHECK(kempe_model_start_in(l.model, "equilibrium", &started) == KEMPE_E_ARGUMENT);
        CHECK(strstr(kempe_context_message(l.context), "configure it with -DKEMPE_ANALYSES=ON"));
        load_rejected(MODEL("equilibrium"), "model.yaml:4:13: start at: this build of Kempe finds no equilibrium");
    }
    kempe_model_free(started);
    unload(&l);
}

static void words_have_their_place(void)
{
    load_rejected(MODEL("equilibria"), "model.yaml:4:13: start at: unknown state 'equilibria': 'start', 'equilibrium'");
    load_rejected(MODEL("[start]"), "model.yaml:4:13: ");
}

int main(void)
{
    TEST(a_build_without_equilibria_refuses_them);
    TEST(words_have_their_place);
    return check_report();
}
