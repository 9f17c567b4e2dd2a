// The WebSocket: text both ways, pictures in; each picture is acknowledged once it is painted.

const RETRY_MS = [300, 1000, 2000, 5000];

/**
 * @typedef {Object} Picture
 * @property {any} header
 * @property {Object<string, ArrayBuffer>} parts
 */

export class Connection {
  /**
   * @param {(message: any) => void} onText
   * @param {(picture: Picture) => Promise<void>} onPicture resolves when it is painted
   * @param {(open: boolean) => void} onStatus
   */
  constructor(onText, onPicture, onStatus) {
    this.onText = onText;
    this.onPicture = onPicture;
    this.onStatus = onStatus;
    this.tries = 0;
    this.open();
  }

  open() {
    const address = new URL("socket", location.href);
    address.protocol = "ws:";
    this.socket = new WebSocket(address);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => {
      this.tries = 0;
      this.onStatus(true);
    };
    this.socket.onclose = () => {
      this.tries += 1;
      this.onStatus(false);
      setTimeout(() => this.open(), RETRY_MS[Math.min(this.tries, RETRY_MS.length) - 1]);
    };
    this.socket.onmessage = (event) => this.receive(event.data);
  }

  /** @param {string | ArrayBuffer} data */
  async receive(data) {
    if (typeof data === "string") {
      this.onText(JSON.parse(data));
      return;
    }
    const picture = parse(data);
    try {
      await this.onPicture(picture);
    } finally {
      this.send({ type: "ack", number: picture.header.number });
    }
  }

  /** @param {Object} message */
  send(message) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }
}

/** Values that were sent and are not back in a state of the server: an older answer undoes no newer change. */
export class Unanswered {
  constructor() {
    /** @type {string[]} */
    this.sent = [];
  }

  /** @param {any} value */
  add(value) {
    this.sent.push(JSON.stringify(value));
  }

  /**
   * Take a value of the server's state in, and return whether it is to be shown: no newer one is on its way there.
   * @param {any} value
   * @returns {boolean}
   */
  isNewest(value) {
    const at = this.sent.lastIndexOf(JSON.stringify(value));
    this.sent = at < 0 ? [] : this.sent.slice(at + 1); // another one is somebody else's, or of a new connection
    return this.sent.length === 0;
  }
}

/**
 * Take a binary message apart: 4 bytes with the length of the header, the header in JSON, the parts.
 * @param {ArrayBuffer} data
 * @returns {Picture}
 */
export function parse(data) {
  const length = new DataView(data).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  /** @type {Object<string, ArrayBuffer>} */
  const parts = {};
  let at = 4 + length;
  for (const [name, size] of header.parts) {
    parts[name] = data.slice(at, at + size);
    at += size;
  }
  return { header, parts };
}
