// A page read from disk may start no Worker, which the search needs: there a hidden frame is one.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super()
      const frame = document.createElement("iframe")
      frame.hidden = true
      document.body.appendChild(frame)
      this.inside = frame.contentWindow
      addEventListener("message", (event) => {
        if (event.source !== this.inside) return
        const passed = new MessageEvent("message", { data: event.data })
        this.dispatchEvent(passed)
        if (this.onmessage) this.onmessage(passed)
      })
      const page = this.inside.document
      page.open()
      page.write("<!doctype html><html><body></body></html>")
      page.close()
      const load = (address) =>
        new Promise((loaded, failed) => {
          const script = page.createElement("script")
          script.src = address
          script.onload = loaded
          script.onerror = failed
          page.body.appendChild(script)
        })
      this.inside.eval("window.postMessage = parent.postMessage.bind(parent)")
      this.inside.importScripts = (...urls) =>
        urls.reduce((before, one) => before.then(() => load(one)), Promise.resolve())
      this.ready = load(url)
    }

    postMessage(data) {
      this.ready.then(() => this.inside.dispatchEvent(new MessageEvent("message", { data })))
    }

    terminate() {}
  }
}
