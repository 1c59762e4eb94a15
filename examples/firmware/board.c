/* A board's main loop, as a sketch: give it the six functions below, and it speaks. */
#include "somatic_wire.h"

#define CHANNELS 64
#define BITS 10

extern uint16_t read_channel(unsigned channel);
extern int set_wiper(unsigned channel, uint8_t wiper); /* 0 when that worked */
extern uint32_t micros(void);
extern int next_byte(void); /* from the line, -1 when there is none */
extern void send(const uint8_t *bytes, size_t length); /* returns when all have left */
extern uint8_t boot_number(void); /* another after each start: counted in EEPROM, or an open channel's noise */

static struct somatic_head head;
static uint32_t rate_mhz; /* 0: as many frames as the line takes */
static int running = 1;
static uint8_t line[SOMATIC_LINE];

static void say_identity(uint8_t request)
{
    struct somatic_identity identity = {0, 0, CHANNELS, BITS, 0, 0, "sketch 1"};
    identity.request = request;
    identity.running = (uint8_t)running;
    identity.rate_mhz = rate_mhz;
    send(line, somatic_say_identity(line, &head, &identity));
}

static void obey(const struct somatic_command *command)
{
    uint8_t status = SOMATIC_DONE;
    uint32_t value = 0;
    if (command->board != head.board && command->board != SOMATIC_ANY_BOARD)
        return;
    head.time_us = micros();
    switch (command->kind) {
    case SOMATIC_IDENTIFY:
        say_identity(command->request);
        return;
    case SOMATIC_RATE:
        value = rate_mhz = command->rate_mhz;
        break;
    case SOMATIC_WIPER:
        value = command->wiper;
        if (command->channel >= CHANNELS)
            status = SOMATIC_BAD;
        else if (set_wiper(command->channel, command->wiper) != 0)
            status = SOMATIC_FAILED;
        break;
    case SOMATIC_START:
        running = 1;
        break;
    case SOMATIC_STOP:
        running = 0;
        break;
    default:
        status = SOMATIC_UNKNOWN;
    }
    send(line, somatic_answer(line, &head, command->request, command->kind, status, value));
}

void run_board(uint16_t board)
{
    static struct somatic_ear ear;
    static uint16_t values[CHANNELS];
    struct somatic_command command;
    uint32_t last_us = micros();
    head.board = board;
    head.boot = boot_number();
    head.time_us = last_us;
    say_identity(0);
    for (;;) {
        int byte;
        uint32_t now_us = micros();
        /* 10^9 / mHz is the period in microseconds. */
        uint32_t period_us = rate_mhz ? 1000000000u / rate_mhz : 0;
        while ((byte = next_byte()) >= 0)
            if (somatic_hear(&ear, (uint8_t)byte, &command))
                obey(&command);
        if (running && now_us - last_us >= period_us) {
            unsigned channel;
            last_us = head.time_us = now_us;
            for (channel = 0; channel < CHANNELS; channel++)
                values[channel] = read_channel(channel);
            send(line, somatic_frame(line, &head, BITS, values, CHANNELS));
            head.sequence++;
        }
    }
}
