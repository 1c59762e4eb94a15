/** The token between tabs: a link to a moment has none, and a tab that shows the page already can give it. */

const CHANNEL = "somatic token";

/** Only pages of the same server hear each other: the browser keeps the channel to one origin. */
export class Tokens {
  /**
   * @param {() => string} mine the token of this tab, once the server has taken it; else nothing
   * @param {(token: string) => void} take what to do with one that another tab gives
   */
  constructor(mine, take) {
    this.channel = new BroadcastChannel(CHANNEL);
    this.channel.onmessage = ({ data }) => {
      const token = mine();
      if (data?.asks && token) this.channel.postMessage({ token });
      else if (typeof data?.token === "string") take(data.token);
    };
  }

  /** Asks the other tabs. */
  ask() {
    this.channel.postMessage({ asks: true });
  }
}

/**
 * The token in an address that somatic printed, or in a part of it; null where there is none.
 * @param {string} text
 */
export function tokenIn(text) {
  return /(?:^|token=)([0-9a-f]{32})\b/.exec(text.trim())?.[1] ?? null;
}
