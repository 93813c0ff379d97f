/* Controller and plant of two eccentric masses in closed loop; noise of each sample on standard input. */
#include <stdio.h>

#include "ctrl.h"
#include "places.h" /* ROW, STEP; of each measured value the places in both, measured and told */
#include "plant.h"

#define COUNT (sizeof measured / sizeof measured[0])

int main(void)
{
    plant_state plant;
    ctrl_state ctrl;
    double noise[COUNT];
    plant_start(&plant);
    ctrl_start(&ctrl);
    while (fread(noise, sizeof noise[0], COUNT, stdin) == COUNT) {
        size_t i;
        for (i = 0; i < COUNT; i++) {
            ctrl.w[told[i]] = plant.w[measured[i]] + noise[i];
        }
        ctrl_step(&ctrl, STEP);
        fwrite(plant.w + ROW, sizeof(double), 8, stdout);
        fwrite(ctrl.w + CTRL_VOLTAGE_1, sizeof(double), 2, stdout);
        fwrite(ctrl.w + CTRL_STAGE, sizeof(double), 1, stdout);
        fwrite(ctrl.w + CTRL_CAUSE, sizeof(double), 1, stdout);
        fwrite(ctrl.w + CTRL_DRIVES, sizeof(double), 1, stdout);
        plant.w[PLANT_VOLTAGE_1] = ctrl.w[CTRL_VOLTAGE_1];
        plant.w[PLANT_VOLTAGE_2] = ctrl.w[CTRL_VOLTAGE_2];
        plant_step(&plant, STEP);
    }
    return 0;
}
