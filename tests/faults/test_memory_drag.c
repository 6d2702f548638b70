/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: once */
/* A drag without memory: it fails with that message, or answers. */
#include "exhaust.h"
#include <kempe/workbench.h>
#include <stdio.h>
#include <string.h>

static kempe_status drag(scene *s)
{
    static const char *const requests[] = {
        "{\"session\":null,\"text\":\"kempe: 1\\nbodies:\\n  a: {joint: {revolute: z, at: ground}, mass: 1, "
        "points: {P: [1, 0, 0]}}\\n  b: {joint: {revolute: z, at: a.P}, mass: 1, points: {P: [1, 0, 0]}}\\n"
        "ground: {points: {P: [1, 1, 0]}}\\nloops: {c: {ball: [b.P, ground.P]}}\\nstart: {q: {b: 90 "
        "deg}}\\n\",\"body\":null}",
        "{\"session\":1,\"q\":{\"a\":0.1},\"body\":\"a\",\"point\":[1,0,0],\"target\":[1,1,0]}",
        "{\"text\":\"kempe: 1\\nbodies: 3\\n\"}",
    };
    kempe_drag *drag = NULL;
    kempe_status status = kempe_drag_new(s->context, "model.yaml", &drag);
    untouched(status, drag);
    for (size_t k = 0; drag && k < sizeof requests / sizeof *requests; k++) {
        char *answer = NULL;
        const kempe_status one = kempe_drag_take(drag, requests[k], &answer);
        CHECK(one == KEMPE_E_MEMORY || answer);
        kempe_text_free(answer);
        if (one == KEMPE_E_MEMORY) {
            status = one;
            break;
        }
    }
    kempe_drag_free(drag);
    return status;
}

static const named_stage stages[] = {{"drag", drag}};

int main(void)
{
    return exhaust_alone(stages, sizeof stages / sizeof *stages, 23);
}
