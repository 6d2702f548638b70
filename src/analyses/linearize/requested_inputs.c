/* SPDX-License-Identifier: BSD-3-Clause */
#include "analyses/linearize/requested_inputs.h"
#include "base/memory.h"
#include "model/data/model_context.h"
#include "model/language/nearest.h"
#include "model/read/read_outputs.h"
#include "model/read/read_values.h"
#include "model/read/requests.h"
#include <string.h>

static const kmp_place nowhere = {0, 0, 0};

static int find_drive(kmp_request *a, const char *name)
{
    kmp_nearest nearest = kmp_nearest_begin(name);
    for (int k = 0; k < a->model.closure_count; k++) {
        if (a->model.closures[k].kind != KMP_CLOSURE_drive)
            continue;
        if (strcmp(a->model.closures[k].name, name) == 0)
            return k;
        kmp_nearest_offer(&nearest, a->model.closures[k].name);
    }
    kmp_reader_complain_near(&a->r, nowhere, &nearest, "the model has no drive '%s'", name);
    return -1;
}

static bool add(kmp_request *a, kmp_requested_inputs *inputs, kmp_requested_input input, const char *name)
{
    for (int k = 0; k < inputs->count; k++)
        if (strcmp(inputs->input[k].name, name) == 0) {
            kmp_reader_complain(&a->r, nowhere, "'%s' is given twice", name);
            return true;
        }
    input.name = kmp_strdup(name);
    inputs->input[inputs->count] = input;
    inputs->count += input.name != NULL;
    return input.name;
}

/* BODY.POINT.x, or BODY.POINT for all three. */
static bool add_force(kmp_request *a, kmp_requested_inputs *inputs, const char *argument)
{
    static const char *const axes[] = {"x", "y", "z"};
    const char *dot = strrchr(argument, '.');
    bool three = !dot || dot == strchr(argument, '.');
    int only = three ? -1 : kmp_name_find(KMP_NAMES_OF(axes), dot + 1);
    if (only >= 0)
        argument = kmp_reader_say(&a->r, "%.*s", (int)(dot - argument), argument);
    int point = kmp_read_point_text(&a->r, nowhere, argument, "force");
    bool ok = true;
    for (int axis = 0; point >= 0 && ok && axis < 3; axis++)
        if (only < 0 || only == axis)
            ok = add(a, inputs, (kmp_requested_input){KMP_REQUESTED_FORCE, point, axis, NULL},
                     kmp_reader_say(&a->r, "force(%s.%s)", argument, axes[axis]));
    return ok;
}

static bool add_word(kmp_request *a, kmp_requested_inputs *inputs, const char *word)
{
    const char *argument = kmp_read_argument(&a->r, word, "force");
    if (argument)
        return add_force(a, inputs, argument);
    kmp_requested_input input = {KMP_REQUESTED_PARAMETER, -1, 0, NULL};
    if ((argument = kmp_read_argument(&a->r, word, "effort"))) {
        input.kind = KMP_REQUESTED_EFFORT;
        input.index = kmp_read_motion_text(&a->r, nowhere, argument, "effort");
    } else if ((argument = kmp_read_argument(&a->r, word, "drive"))) {
        input.kind = KMP_REQUESTED_DRIVE;
        input.index = find_drive(a, argument);
    } else if ((input.index = kempe_model_input_find(&a->model, word)) >= 0) {
        input.kind = KMP_REQUESTED_INPUT;
    } else if (strchr(word, '(')) {
        kmp_reader_complain(&a->r, nowhere,
                            "unknown input '%s'; available: effort(JOINT), force(BODY.POINT.x), force(BODY.POINT), "
                            "drive(DRIVE), and the names of inputs and parameters",
                            word);
        return true;
    }
    return input.kind != KMP_REQUESTED_PARAMETER && input.index < 0 ? true : add(a, inputs, input, word);
}

kempe_status kmp_requested_inputs_read(const kempe_model *model, const char *words, kmp_requested_inputs *inputs)
{
    kmp_request a;
    kmp_requested_inputs read = {0};
    kempe_status status = kmp_request_begin(&a, model, "inputs", words);
    if (status == KEMPE_OK) {
        read.input = KMP_NEW(kmp_requested_input, 3 * a.count);
        bool ok = read.input;
        for (int k = 0; ok && k < a.count; k++)
            ok = add_word(&a, &read, a.word[k]);
        status = ok ? KEMPE_OK : kmp_fail_memory(kmp_model_context(model));
    }
    status = kmp_request_end(&a, status);
    if (status == KEMPE_OK)
        *inputs = read;
    else
        kmp_requested_inputs_free(&read);
    return status;
}

void kmp_requested_inputs_free(kmp_requested_inputs *inputs)
{
    for (int k = 0; k < inputs->count; k++)
        kmp_free(inputs->input[k].name);
    kmp_free(inputs->input);
    *inputs = (kmp_requested_inputs){0};
}
