/* Outputs of a block for rows of doubles on standard input, each time and inputs, in runs of so many steps. */
#include <stdio.h>
#include <string.h>

#include "block.h"
#include "places.h" /* STEPS; indices of inputs and outputs in a row */

enum { WIDTH = 1 + sizeof inputs / sizeof inputs[0], OUTPUTS = sizeof outputs / sizeof outputs[0] };

int main(void)
{
    static double row[WIDTH], results[OUTPUTS];
    static block_state state;
    size_t i, step;
    for (step = 0; fread(row, sizeof row, 1, stdin) == 1; step++) {
        if (step % STEPS == 0) {
            block_start(&state);
        }
        for (i = 1; i < WIDTH; i++) {
            state.w[inputs[i - 1]] = row[i];
        }
        block_step(&state, row[0]);
        for (i = 0; i < OUTPUTS; i++) {
            results[i] = state.w[outputs[i]];
        }
        fwrite(results, sizeof results, 1, stdout);
    }
    return 0;
}
