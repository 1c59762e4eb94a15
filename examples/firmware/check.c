/* On a host: what the C code writes and hears, one line in, one line out. For checks against docs/wire/vectors.json.
 *
 *   frame BOARD BOOT SEQUENCE TIME BITS VALUE...             the packet in hex
 *   partial BOARD BOOT SEQUENCE TIME BITS CHANNELS CHANNEL=VALUE...
 *   identity BOARD BOOT SEQUENCE TIME REQUEST RUNNING CHANNELS BITS LAYOUT RATE [TEXT]
 *   answer BOARD BOOT SEQUENCE TIME REQUEST COMMAND STATUS VALUE
 *   hear HEX                                                 KIND BOARD REQUEST RATE CHANNEL WIPER, once a command
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "somatic_wire.h"

static uint32_t number(void)
{
    const char *word = strtok(NULL, " \n");
    return word ? (uint32_t)strtoul(word, NULL, 10) : 0;
}

static void show(const uint8_t *line, size_t length)
{
    size_t i;
    for (i = 0; i < length; i++)
        printf("%02x", line[i]);
}

int main(void)
{
    static char text[1 << 16];
    static uint8_t line[SOMATIC_LINE];
    while (fgets(text, sizeof text, stdin)) {
        const char *what = strtok(text, " \n");
        static uint16_t values[SOMATIC_CHANNELS];
        static uint8_t changed[SOMATIC_CHANNELS];
        struct somatic_head head;
        size_t count = 0;
        uint8_t bits;
        char *word;
        if (!what)
            continue;
        if (strcmp(what, "hear") == 0) {
            struct somatic_ear ear = {{0}, 0, 0, 0, 0};
            const char *hex = strtok(NULL, " \n");
            for (; hex && hex[0] && hex[1]; hex += 2) {
                struct somatic_command c = {0, 0, 0, 0, 0, 0};
                char two[3] = {hex[0], hex[1], 0};
                if (somatic_hear(&ear, (uint8_t)strtoul(two, NULL, 16), &c))
                    printf("%u %u %u %lu %u %u ", c.kind, c.board, c.request, (unsigned long)c.rate_mhz, c.channel, c.wiper);
            }
            printf("\n");
            continue;
        }
        head.board = (uint16_t)number();
        head.boot = (uint8_t)number();
        head.sequence = number();
        head.time_us = number();
        if (strcmp(what, "frame") == 0) {
            bits = (uint8_t)number();
            while (count < SOMATIC_CHANNELS && (word = strtok(NULL, " \n")))
                values[count++] = (uint16_t)strtoul(word, NULL, 10);
            show(line, somatic_frame(line, &head, bits, values, count));
        } else if (strcmp(what, "partial") == 0) {
            bits = (uint8_t)number();
            count = number();
            memset(changed, 0, sizeof changed);
            while ((word = strtok(NULL, " \n"))) {
                size_t channel = (size_t)strtoul(word, &word, 10);
                changed[channel] = 1;
                values[channel] = (uint16_t)strtoul(word + 1, NULL, 10);
            }
            show(line, somatic_partial(line, &head, bits, values, changed, count));
        } else if (strcmp(what, "identity") == 0) {
            struct somatic_identity identity;
            identity.request = (uint8_t)number();
            identity.running = (uint8_t)number();
            identity.channels = (uint16_t)number();
            identity.bits = (uint8_t)number();
            identity.layout = number();
            identity.rate_mhz = number();
            word = strtok(NULL, "\n");
            identity.firmware = word ? word : "";
            show(line, somatic_say_identity(line, &head, &identity));
        } else if (strcmp(what, "answer") == 0) {
            uint8_t request = (uint8_t)number(), command = (uint8_t)number(), status = (uint8_t)number();
            show(line, somatic_answer(line, &head, request, command, status, number()));
        }
        printf("\n");
    }
    return 0;
}
