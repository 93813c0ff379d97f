/* Disc and controller of a scene in closed loop, as a caller runs them: a row for each sample. */
#include <stdio.h>

#include "ctrl.h"
#include "places.h" /* SAMPLES, LONGEST; of each chamber the places of its variables in both */
#include "plant.h"

#define CHAMBERS (sizeof asked / sizeof asked[0])

int main(void)
{
    plant_state plant;
    ctrl_state ctrl;
    double time = 0.0, since = 0.0;
    int seen = 0;
    plant_start(&plant);
    ctrl_start(&ctrl);
    for (;;) {
        size_t i;
        ctrl.w[CTRL_VIBRATION_X] = plant.w[PLANT_VIBRATION_X];
        ctrl.w[CTRL_VIBRATION_Y] = plant.w[PLANT_VIBRATION_Y];
        ctrl_step(&ctrl, since);
        if ((int)ctrl.w[CTRL_SAMPLES] > seen) {
            seen++;
            printf("%.17g %.17g %.17g", time, plant.w[PLANT_VIBRATION_X], plant.w[PLANT_VIBRATION_Y]);
            for (i = 0; i < CHAMBERS; i++) {
                printf(" %.17g %.17g", ctrl.w[told[i]], plant.w[fills[i]]);
            }
            printf("\n");
        }
        if (seen == SAMPLES) {
            return 0;
        }
        for (i = 0; i < CHAMBERS; i++) {
            plant.w[asked[i]] = ctrl.w[told[i]];
        }
        since = ctrl.w[CTRL_WAIT] < LONGEST ? ctrl.w[CTRL_WAIT] : LONGEST;
        plant_step(&plant, since);
        time += since;
    }
}
